// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// A camera that warms up, where every condition was measured an hour after power-on: the effect fits, and its time
// constant is anything. It is not named, and the report says what is missing.
#include <gtest/gtest.h>

#include "tests/hidden_effects/campaign.hpp"
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

namespace tofgraph::hidden {
namespace {

TEST(UntoldValue, IsWhyAnEffectThatFitsIsNotNamed) {
  const tests::TemporaryFolder folder;
  CampaignOptions options;
  options.design = "B";
  options.seed = 201013;
  options.folder = folder.path() / "campaign";
  options.effects.add_text("warm_up", 1, options.seed);
  make_campaign(options);
  const tests::Outcome outcome =
      tests::shell("\"$TOFGRAPH\" diagnose --quiet --model campaign/model.yaml --data campaign/campaign.yaml -o found",
                   folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto report = nlohmann::json::parse(tests::read_text(folder.path() / "found/report.json"));
  EXPECT_EQ(report.at("verdict"), "unknown");
  const std::string summary = report.at("summary");
  EXPECT_NE(summary.find("warm_up fits, but these conditions do not tell its time_constant"), std::string::npos)
      << summary;
  // What would tell it comes first: a camera that was just switched on.
  const auto& next = report.at("next").at(0);
  EXPECT_EQ(next.at("effects"), nlohmann::json::array({"warm_up"}));
  EXPECT_EQ(next.at("parameter"), "time_constant");
  EXPECT_EQ(next.at("condition").at("time_since_power_on"), 60);
  EXPECT_GT(next.at("standard_deviations"), 2 * next.at("standard_deviations_measured").get<double>());
}

}  // namespace
}  // namespace tofgraph::hidden
