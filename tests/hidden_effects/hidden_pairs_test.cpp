// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: HiddenPairs.*
// Rooms: diagnosis simulation plugins
// Two effects at once that initially resemble something simpler or more complex.
#include <gtest/gtest.h>

#include "tests/hidden_effects/hidden_report.hpp"

namespace tofgraph::hidden {
namespace {

using Names = std::set<std::string>;

/// The first is so nonlinear that linearised sets promise less than it alone achieves, and a map of the pixel response
/// would explain the influence of both on the light.
TEST(HiddenPairs, AReflectanceBesideAPrincipalPointIsNoMap) {
  const nlohmann::json report = report_of({"surface_reflectance", "principal_point"}, 19402).json;
  EXPECT_EQ(names_in(report), (Names{"principal_point", "surface_reflectance"})) << report.at("summary");
}

/// Without the exponent of the warm-up the camera drift grows to its upper limit, and its sign flips gain as much as
/// the exponent.
TEST(HiddenPairs, ARailThatIsOffBesideAWarmUp) {
  const nlohmann::json report = report_of({"warm_up", "rail_offset"}, 217009).json;
  EXPECT_EQ(report.at("verdict"), "tie") << report.at("summary");
  EXPECT_EQ(names_in(report), (Names{"integration_time_offset", "rail_offset", "zero_offset"}));
}

/// A gloss of a hundred times a white board's light resembles the lens at the superpixels' centres, and gives NaN in
/// between: the next best candidate is taken, in each fold.
TEST(HiddenPairs, AnEffectThatGivesNoNumberKeepsNoOtherOut) {
  const nlohmann::json report = report_of({"vignetting", "adc_nonlinearity"}, 16002).json;
  EXPECT_EQ(report.at("verdict"), "named") << report.at("summary");
  EXPECT_EQ(names_in(report), (Names{"adc_nonlinearity", "vignetting"}));
  EXPECT_FALSE(report.at("folds").empty());
  for (const auto& fold : report.at("folds")) EXPECT_EQ(fold.at("chosen").size(), 2U) << fold;
}

/// A warm camera has two offsets, whichever effects were found first.
TEST(HiddenPairs, OneEffectMayStandForSeveralThatWereFound) {
  const nlohmann::json report = report_of({"warm_up", "amplitude_walk"}, 16007).json;
  EXPECT_EQ(report.at("verdict"), "tie") << report.at("summary");
  EXPECT_EQ(names_in(report), (Names{"amplitude_walk", "integration_time_offset", "zero_offset"}));
  for (const auto& effect : report.at("effects")) {
    if (effect.at("name") == "amplitude_walk") continue;
    EXPECT_EQ(effect.at("rivals").at(0).at("name"), "warm_up");
    EXPECT_EQ(effect.at("rivals").at(0).at("in_place_of").size(), 2U);
  }
}

/// Before `rail_scale` is selected, its error looks like scatter of the boards. A map that is estimated again assumes
/// the usual scatter; with this map, fits of further effects ended worse than the model without them.
TEST(HiddenPairs, AMapEstimatedAnewIsNeverWorse) {
  const nlohmann::json report = report_of({"pixel_response", "rail_scale"}, 1, "", {.design = "small"}).json;
  EXPECT_EQ(names_in(report), (Names{"pixel_response", "rail_scale"})) << report.at("summary");
}

/// With the map fixed, which has absorbed the lens' influence on the light, the lens has almost no predicted gain.
TEST(HiddenPairs, AMapMakesRoomForAnEffectBesideIt) {
  const nlohmann::json report = report_of({"pixel_response", "lens_distortion"}, 16001, "", {.design = "small"}).json;
  EXPECT_EQ(names_in(report), (Names{"lens_distortion", "pixel_response"})) << report.at("summary");
}

}  // namespace
}  // namespace tofgraph::hidden
