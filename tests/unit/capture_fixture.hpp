// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A capture in a folder of its own.
#pragma once

#include <gtest/gtest.h>
#include <tofgraph/array.hpp>

#include "io/captures/capture.hpp"
#include "tests/program.hpp"
#include "tests/unit/full_disk.hpp"

namespace tofgraph::tests {

class CaptureFile : public testing::Test {
 protected:
  TemporaryFolder folder;
  std::filesystem::path path = folder.path() / "a.h5";
  std::string why() const {
    return thrown([&] { const io::CaptureReader reader(path); });
  }
};

/// Appends a frame of one float channel of side x side, whose pixels all hold number + 1.
template <class Writer>
void append_frame(Writer& writer, std::uint32_t side, std::size_t number, std::uint64_t counter) {
  std::vector<float> values(std::size_t{side} * side, static_cast<float>(number + 1));
  tofgraph_view view = empty_view();
  view.data = values.data();
  view.type = TOFGRAPH_TYPE_F32;
  view.rank = 2;
  view.extent[0] = view.extent[1] = side;
  view.stride[0] = static_cast<std::int64_t>(side * sizeof(float));
  view.stride[1] = sizeof(float);
  tofgraph_metadata metadata{};
  metadata.size = sizeof metadata;
  metadata.timestamp_ns = 1000 + static_cast<std::int64_t>(number);
  metadata.device_number = counter;
  writer.append(metadata, {&view, 1});
}

inline void expect_words(const std::string& message, const std::vector<std::string>& words) {
  for (const std::string& word : words)
    EXPECT_NE(message.find(word), std::string::npos) << word << " is not in: " << message;
}

}  // namespace tofgraph::tests
