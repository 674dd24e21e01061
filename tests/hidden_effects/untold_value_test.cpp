// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// A camera that warms up, where every condition was measured an hour after power-on: the effect fits, and its time
// constant is anything. Others that explain as much are named in its place, tied with it; where there are none it is
// not named, and the report says what is missing. Either way a camera that was just switched on comes first.
#include <gtest/gtest.h>

#include "tests/hidden_effects/campaign.hpp"
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

#include <set>
#include <string>

namespace tofgraph::hidden {
namespace {

/// The report of a campaign with a warm_up.
nlohmann::json report_with(const std::string& options_of_search, const std::string& further_effect = "") {
  const tests::TemporaryFolder folder;
  CampaignOptions options;
  options.design = "B";
  options.seed = 201013;
  options.folder = folder.path() / "campaign";
  options.effects.add_text("warm_up", 1, options.seed);
  if (!further_effect.empty()) options.effects.add_text(further_effect, 1, options.seed);
  make_campaign(options);
  const tests::Outcome outcome = tests::shell(
      "\"$TOFGRAPH\" diagnose --quiet --model campaign/model.yaml --data campaign/campaign.yaml -o found " +
          options_of_search,
      folder.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  auto report = nlohmann::json::parse(tests::read_text(folder.path() / "found/report.json"));
  report["model_file"] = tests::read_text(folder.path() / "found/model.yaml");
  return report;
}

void expect_a_cold_camera(const nlohmann::json& next) {
  EXPECT_EQ(next.at("condition").at("time_since_power_on"), 60);
  EXPECT_GT(next.at("standard_deviations"), 2 * next.at("standard_deviations_measured").get<double>());
}

TEST(UntoldValue, OthersThatExplainAsMuchAreTiedWithIt) {
  const nlohmann::json report = report_with("", "source_position");
  EXPECT_EQ(report.at("verdict"), "tie") << report.at("summary");
  std::set<std::string> names;
  for (const auto& effect : report.at("effects")) {
    names.insert(effect.at("name"));
    const bool other = effect.at("name") == "source_position";
    EXPECT_EQ(effect.at("tied_with"), other ? nlohmann::json::array() : nlohmann::json::array({"warm_up"}));
    EXPECT_TRUE(other || effect.at("rivals").at(0).at("in_place_of").size() == 2) << effect.at("name");
  }
  EXPECT_EQ(names, (std::set<std::string>{"integration_time_offset", "source_position", "zero_offset"}));
  const nlohmann::json& gap = report.at("gap");
  EXPECT_LT(gap.at("held_out_after"), 1.1 * gap.at("noise_and_scatter").get<double>());
  expect_a_cold_camera(report.at("next").at(0));
  const std::string model = report.at("model_file");
  EXPECT_NE(model.find("# - {effect: warm_up"), std::string::npos) << model;
  EXPECT_EQ(model.find("# - {effect: warm_up"), model.rfind("# - {effect: warm_up")) << "it stands for both, once";
}

TEST(UntoldValue, IsWhyAnEffectThatFitsIsNotNamed) {
  const nlohmann::json report = report_with("--without zero_offset");
  EXPECT_EQ(report.at("verdict"), "unknown");
  const std::string summary = report.at("summary");
  EXPECT_NE(summary.find("warm_up fits, but these conditions do not tell its time_constant"), std::string::npos)
      << summary;
  const auto& next = report.at("next").at(0);
  EXPECT_EQ(next.at("effects"), nlohmann::json::array({"warm_up"}));
  EXPECT_EQ(next.at("parameter"), "time_constant");
  expect_a_cold_camera(next);
}

}  // namespace
}  // namespace tofgraph::hidden
