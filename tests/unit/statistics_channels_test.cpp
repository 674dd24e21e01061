// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Statistics of channels other than lengths: parameters that do not apply to them.
#include <gtest/gtest.h>
#include <tofgraph/harness.hpp>

#include "tests/program.hpp"
#include "tests/unit/full_disk.hpp"

namespace tofgraph::tests {
namespace {

/// The error for amplitudes and their reference; empty: no error.
std::string why(const std::string& more) {
  return thrown([&] {
    Harness stage("statistics " + more);
    for (const char* name : {"amplitude", "true_amplitude"})
      stage.put<float>(name, {4, 5}, std::vector<float>(20), {.unit = "counts"});
    stage.prepare();
  });
}

void expect_words(const std::string& message, const std::string& words) {
  EXPECT_NE(message.find(words), std::string::npos) << words << " is not in: " << message;
}

TEST(StatisticsChannels, EdgesAreThoseOfLengths) {
  const std::string against = "channel=amplitude reference=true_amplitude part=";
  EXPECT_EQ(why(against + "all"), "");
  for (const char* part : {"edge", "flat", "each"})
    expect_words(why(against + part),
                 "'part': edges are steps of a length; 'amplitude' is in counts: write channel: depth, or part: all");
}

TEST(StatisticsChannels, WithoutLengthsADecoderIsNamed) {
  expect_words(why(""), "has amplitude, true_amplitude: a decoder above makes distance, e.g. four_phase_decoder");
}

}  // namespace
}  // namespace tofgraph::tests
