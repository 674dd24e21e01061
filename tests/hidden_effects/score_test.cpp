// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The quick part of the score: campaigns of the plain camera, searched by `tofgraph diagnose` as a user runs it.
#include <gtest/gtest.h>

#include "tests/hidden_effects/score_run.hpp"
#include "tests/program.hpp"

#include <cmath>
#include <ostream>

namespace tofgraph::hidden {

void PrintTo(const Case& what, std::ostream* out) { *out << what.key(); }

namespace {

constexpr std::uint64_t seed = 300;

std::vector<Case> quick_cases() {
  for (const Suite& suite : suites()) {
    if (suite.name == "quick") return suite.make(seed, 1);
  }
  return {};
}

/// What was hidden, as a test's name.
std::string name_of(const Case& what) {
  std::string name = what.pattern + (what.without.empty() ? "" : "without_");
  for (const std::string& effect : what.effects) name += (name.empty() || name.back() == '_' ? "" : "_and_") + effect;
  return name.empty() ? "nothing_" + std::to_string(what.seed) : name;
}

class QuickScore : public testing::TestWithParam<Case> {};

TEST_P(QuickScore, IsRight) {
  const Case& what = GetParam();
  const tests::TemporaryFolder folder;
  Bench bench;
  bench.scratch = folder.path();
  const Score score = run(what, bench);
  if (!what.without.empty() || !what.pattern.empty())
    EXPECT_TRUE(score.verdict == "unknown" || score.verdict == "named_with_rest") << score.line();
  else
    EXPECT_TRUE(is_right(score)) << score.line();
  if (!what.effects.empty() && what.without.empty() && std::isfinite(closed(score))) {
    EXPECT_GT(closed(score), 0.9) << score.line();
  }
}

INSTANTIATE_TEST_SUITE_P(Quick, QuickScore, testing::ValuesIn(quick_cases()),
                         [](const auto& tested) { return name_of(tested.param); });

}  // namespace
}  // namespace tofgraph::hidden
