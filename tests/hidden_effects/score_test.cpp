// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: */tap*:*/cross*:*/amp*:*/int*:*/source*:*/mod*:*_31?:*_and_*:*/without*:*/angular*
// Rooms: diagnosis simulation plugins
// The quick part of the score: campaigns of the plain camera, searched by `tofgraph diagnose` as a user runs it.
#include <gtest/gtest.h>

#include "tests/hidden_effects/score_run.hpp"
#include "tests/hidden_effects/score_table.hpp"
#include "tests/program.hpp"

#include <algorithm>
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

/// Hidden effects as a test name.
std::string name_of(const Case& what) {
  std::string name = what.pattern + (what.without.empty() ? "" : "without_");
  for (const std::string& effect : what.effects) name += (name.empty() || name.back() == '_' ? "" : "_and_") + effect;
  return name.empty() ? "nothing_" + std::to_string(what.seed) : name;
}

/// Effects visible in the observables but not in the depth: its gap equals the noise with and without them.
bool is_level(const Case& what) {
  return what.effects == std::vector<std::string>{"tap_mismatch"} ||
         what.effects == std::vector<std::string>{"source_amplitude"};
}

class QuickScore : public testing::TestWithParam<Case> {};

TEST_P(QuickScore, IsRight) {
  const Case& what = GetParam();
  const tests::TemporaryFolder folder;
  Bench bench;
  bench.scratch = folder.path();
  // Half of the boards and of the frames suffice, unless the remaining gap is then uncertain by more than a tenth.
  const bool needs_all = what.effects == std::vector<std::string>{"integration_time_offset"};
  if (!needs_all) bench.every = bench.frames = 2;
  const Score score = run(what, bench);
  if (!what.without.empty() || !what.pattern.empty())
    EXPECT_TRUE(score.verdict == "unknown" || score.verdict == "named_with_rest") << score.line();
  else
    EXPECT_TRUE(is_right(score)) << score.line();
  if (what.effects.empty() || !what.without.empty()) return;
  const std::optional<double> share = closed(score);
  ASSERT_EQ(share.has_value(), !is_level(what)) << score.line();
  if (share) {
    // With so few conditions, noise in the maps affects the held-out conditions.
    const bool maps = std::ranges::find(what.effects, "fixed_pattern") != what.effects.end();
    EXPECT_GT(*share, maps ? 0.85 : 0.9) << score.line();
    if (!maps) {
      EXPECT_NEAR(score.after / score.floor, 1, 0.1) << score.line();  // what remains after noise and scatter
    }
  } else {
    EXPECT_LE(score.after, score.before + 0.05 * score.floor) << score.line();
  }
}

/// Gaps in the depth: before, after, and that of the noise.
Score gap(double before, double after, double floor) {
  return {.what = {.suite = "quick", .effects = {"wiggling"}}, .before = before, .after = after, .floor = floor};
}

TEST(Closed, IsTheShareOfWhatIsAboveTheNoise) {
  EXPECT_DOUBLE_EQ(closed(gap(5, 2, 1)).value(), 0.75);
  EXPECT_DOUBLE_EQ(closed(gap(5, 6, 1)).value(), -0.25);
  EXPECT_FALSE(closed(gap(1.2, 0, 1)));
  EXPECT_TRUE(closed(gap(1.21, 0, 1)));
}

/// NaN must not be treated as a case without a gap.
TEST(Closed, WhatIsNoNumberIsNotClosed) {
  const double none = std::nan("");
  for (const Score& score : {gap(none, 1, 1), gap(5, none, 1), gap(5, 1, none)}) {
    ASSERT_TRUE(closed(score));
    EXPECT_FALSE(*closed(score) > 0.9);
    EXPECT_NE(table({score, gap(5, 1, 1), gap(1, 1, 1)}).find("1 of 2 (50 %), median 100 %, 1 more with no gap above"),
              std::string::npos)
        << table({score, gap(5, 1, 1), gap(1, 1, 1)});
    EXPECT_NE(table({score, score, gap(5, 1, 1)}).find("1 of 3 (33 %), median -inf %, 0 more"), std::string::npos)
        << table({score, score, gap(5, 1, 1)});
  }
}

INSTANTIATE_TEST_SUITE_P(Quick, QuickScore, testing::ValuesIn(quick_cases()),
                         [](const auto& tested) { return name_of(tested.param); });

}  // namespace
}  // namespace tofgraph::hidden
