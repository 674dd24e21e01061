// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: UntoldValue.OthersThat*
// Rooms: diagnosis simulation plugins
// A camera with warm-up whose conditions were all measured an hour after power-on: the effect fits, and its time
// constant is undetermined. Others that explain as much are named instead, tied with it; without others it is not
// named, and the report says what is missing. In both cases a camera just switched on is the first suggestion.
#include <gtest/gtest.h>

#include "tests/hidden_effects/hidden_report.hpp"

namespace tofgraph::hidden {
namespace {

/// Half of the conditions and of the frames: they do not determine the time constant of a warm camera either.
const CampaignOptions few = {.every = 2, .frames = 2};

void expect_a_cold_camera(const nlohmann::json& next) {
  EXPECT_EQ(next.at("condition").at("time_since_power_on"), 60);
  EXPECT_GT(next.at("standard_deviations"), 2 * next.at("standard_deviations_measured").get<double>());
}

TEST(UntoldValue, OthersThatExplainAsMuchAreTiedWithIt) {
  const auto [report, model] = report_of({"warm_up", "source_position"}, 201013, "", few);
  EXPECT_EQ(report.at("verdict"), "tie") << report.at("summary");
  for (const auto& effect : report.at("effects")) {
    const bool other = effect.at("name") == "source_position";
    EXPECT_EQ(effect.at("tied_with"), other ? nlohmann::json::array() : nlohmann::json::array({"warm_up"}));
    EXPECT_TRUE(other || effect.at("rivals").at(0).at("in_place_of").size() == 2) << effect.at("name");
  }
  EXPECT_EQ(names_in(report), (std::set<std::string>{"integration_time_offset", "source_position", "zero_offset"}));
  const nlohmann::json& gap = report.at("gap");
  EXPECT_LT(gap.at("held_out_after"), 1.1 * gap.at("noise_and_scatter").get<double>());
  expect_a_cold_camera(report.at("next").at(0));
  EXPECT_NE(model.find("# - {effect: warm_up"), std::string::npos) << model;
  EXPECT_EQ(model.find("# - {effect: warm_up"), model.rfind("# - {effect: warm_up")) << "it stands for both, once";
}

TEST(UntoldValue, IsWhyAnEffectThatFitsIsNotNamed) {
  const nlohmann::json report = report_of({"warm_up"}, 201013, "--without zero_offset", few).json;
  EXPECT_EQ(report.at("verdict"), "unknown");
  const std::string summary = report.at("summary");
  EXPECT_NE(summary.find("warm_up fits, but these conditions do not determine its time_constant"), std::string::npos)
      << summary;
  const auto& next = report.at("next").at(0);
  EXPECT_EQ(next.at("effects"), nlohmann::json::array({"warm_up"}));
  EXPECT_EQ(next.at("parameter"), "time_constant");
  expect_a_cold_camera(next);
}

}  // namespace
}  // namespace tofgraph::hidden
