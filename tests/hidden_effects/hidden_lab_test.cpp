// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: HiddenLab.*
// Rooms: diagnosis simulation plugins
// A constant and an offset with the integration time, measured on a small grid with one frame per condition.
#include <gtest/gtest.h>

#include "tests/hidden_effects/hidden_report.hpp"

namespace tofgraph::hidden {
namespace {

using Names = std::set<std::string>;

nlohmann::json lab_report(const std::vector<std::string>& effects, const std::string& design, std::uint64_t seed) {
  const CampaignOptions options = {.design = design, .jitter = 0.8, .frames = 1};
  return report_of(effects, seed, "", options).json;
}

void expect_no_gap(const nlohmann::json& report) {
  EXPECT_LT(report.at("gap").at("after"), 1.5 * report.at("gap").at("noise_and_scatter").get<double>());
  EXPECT_LT(report.at("gap").at("after"), 1.5e-3);  // m
}

/// The constant is no drift, although the order of measurement is known: without effects it was attributed to drift,
/// and sets of effects ended worse than their own subsets.
TEST(HiddenLab, AConstantIsNoDrift) {
  const auto report = lab_report({"zero_offset:offset=4mm", "integration_time_offset:slope=4mm"}, "lab2x3", 11101);
  EXPECT_EQ(names_in(report), (Names{"integration_time_offset", "zero_offset"})) << report.at("summary");
  expect_no_gap(report);
}

/// The camera's noise differs from the profile's, the only reference for a single frame: the effects' contribution was
/// not recognised.
TEST(HiddenLab, OneFrameShowsItsNoise) {
  const auto report =
      lab_report({"zero_offset:offset=18.09mm", "integration_time_offset:slope=0mm,linear=-8.11m/s"}, "lab2x1", 13001);
  EXPECT_EQ(names_in(report), (Names{"integration_time_offset", "zero_offset"})) << report.at("summary");
  expect_no_gap(report);
  EXPECT_NEAR(report.at("lack_of_fit").at("chi2_over_freedom").get<double>(), 1, 0.05);
}

/// Without the constant the drift grows to its bound: then neither it nor its mean is an estimate. With such a large
/// mean two folds did without the constant, which was therefore dropped.
TEST(HiddenLab, ADriftAtItsBoundHasNoMean) {
  const auto report = lab_report(
      {"zero_offset:offset=-4.92mm", "integration_time_offset:slope=11.37mm", "wiggling:amplitude=5mm,phase=1.33rad"},
      "lab3x1", 252004);
  EXPECT_EQ(names_in(report), (Names{"integration_time_offset", "wiggling", "zero_offset"})) << report.at("summary");
  expect_no_gap(report);
  for (const auto& fold : report.at("folds")) EXPECT_EQ(fold.at("chosen").size(), 3U) << fold;
}

/// All data are from a warm camera: some folds chose a warm-up in place of both effects, and each was rejected.
TEST(HiddenLab, AWarmUpOfAWarmCameraIsAConstant) {
  const auto report = lab_report({"zero_offset:offset=-17.80mm", "integration_time_offset:slope=0mm,linear=-7.24m/s",
                                  "wiggling:amplitude=5mm,phase=0.4rad"},
                                 "lab3x1", 13004);
  EXPECT_EQ(names_in(report), (Names{"integration_time_offset", "wiggling", "zero_offset"})) << report.at("summary");
  expect_no_gap(report);
  // The summary names the alternative and the experiment that decides: a camera that is still cold.
  const std::string summary = report.at("summary");
  EXPECT_NE(summary.find("zero_offset (or warm_up of unknown time_constant)"), std::string::npos) << summary;
  EXPECT_NE(summary.find("To tell zero_offset from warm_up, measure a board at "), std::string::npos) << summary;
  EXPECT_NE(summary.find(" 1 min after power-on."), std::string::npos) << summary;
  for (const auto& effect : report.at("effects")) {
    if (effect.at("name") != "zero_offset") continue;
    EXPECT_TRUE(effect.at("separating_experiment").get<std::string>().starts_with("one board measured repeatedly"));
  }
}

}  // namespace
}  // namespace tofgraph::hidden
