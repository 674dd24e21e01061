// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Mistyped.EveryMistakeIsNamed
// Rooms: diagnosis simulation
// Conditions named by the check before the gap search, on campaigns of the plain camera with hidden effects.
#include "diagnosis/data/plausibility.hpp"
#include "tests/hidden_effects/mistakes.hpp"
#include "tests/hidden_effects/score_cases.hpp"
#include "tests/program.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace tofgraph::hidden {
namespace {

using diagnosis::Contradiction;

/// Campaign shared by all tests: crosstalk, which distorts the distances of dark boards most, and clutter.
class Mistyped : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<tests::TemporaryFolder>();
    CampaignOptions options;
    options.design = "small";
    options.every = 2;
    options.frames = 2;
    options.seed = 61500;
    options.effects.add_text("crosstalk", 1, options.seed);
    options.clutter = clutter_of({"warp", "sessions", "residue", "misplaced"});
    options.folder = folder_->path() / "made";
    make_campaign(options);
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static io::Campaign campaign() {
    config::Diagnostics diagnostics;
    io::Campaign campaign = io::read_campaign(folder_->path() / "made/campaign.yaml", diagnostics);
    EXPECT_TRUE(diagnostics.ok()) << diagnostics.text();
    return campaign;
  }
  /// @param recorded whether the captures state their integration times
  static std::vector<Contradiction> found(const io::Campaign& campaign, bool recorded = true) {
    diagnosis::Measurements measurements = diagnosis::measure(campaign, {});
    if (!recorded) std::ranges::fill(measurements.recorded_times, io::unknown);
    return contradictions(measurements);
  }

  inline static std::unique_ptr<tests::TemporaryFolder> folder_;
};

TEST_F(Mistyped, NothingIsNamedInACampaignThatIsRight) {
  for (const Contradiction& one : found(campaign())) ADD_FAILURE() << one.condition << ": " << one.text;
}

TEST_F(Mistyped, EveryMistakeIsNamed) {
  std::mt19937_64 random(61500);
  for (const Mistake mistake :
       {Mistake::factor_ten, Mistake::distance, Mistake::swapped, Mistake::target, Mistake::integration_time}) {
    for (const bool recorded : {true, false}) {
      io::Campaign wrong = campaign();
      std::vector<std::size_t> at = make_mistake(wrong, mistake, random);
      std::vector<std::size_t> named;
      std::string said;
      for (const Contradiction& one : found(wrong, recorded)) {
        named.push_back(one.condition);
        said += one.text + "\n";
      }
      std::ranges::sort(at);
      EXPECT_EQ(named, at) << mistake_names[static_cast<std::size_t>(mistake)] << ": " << said;
    }
  }
}

TEST_F(Mistyped, TheMessageHasWhatWasWrittenAndWhatTheDataSay) {
  io::Campaign wrong = campaign();
  const auto at = std::ranges::find_if(wrong.conditions, [](const auto& c) { return c.board_distance == 1.0; });
  ASSERT_NE(at, wrong.conditions.end());
  at->board_distance = 10;
  const auto said = found(wrong);
  ASSERT_EQ(said.size(), 1U);
  EXPECT_EQ(said[0].kind, Contradiction::Kind::distance);
  EXPECT_TRUE(said[0].text.starts_with("you wrote 'distance: 10 m', the data say ")) << said[0].text;
  try {
    require_consistent(diagnosis::measure(wrong, {}));
    ADD_FAILURE() << "nothing was thrown";
  } catch (const config::ConfigurationError& error) {
    ASSERT_EQ(error.mistakes().size(), 1U);
    EXPECT_EQ(error.mistakes()[0].at.line, at->place("distance").line);
    EXPECT_GT(at->place("distance").line, at->at.line) << "not where the condition begins";
    EXPECT_TRUE(error.mistakes()[0].hint.ends_with("--exclude-condition " + at->id)) << error.mistakes()[0].hint;
  }
}

}  // namespace
}  // namespace tofgraph::hidden
