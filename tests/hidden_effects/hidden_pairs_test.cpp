// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Two effects at once, where something simpler or richer looks like them at first.
#include <gtest/gtest.h>

#include "tests/hidden_effects/hidden_report.hpp"

namespace tofgraph::hidden {
namespace {

using Names = std::set<std::string>;

/// The first bends so much that linear sets promise less than it does alone, and a map of the pixels' response would
/// explain what both do to the light.
TEST(HiddenPairs, AReflectanceBesideAPrincipalPointIsNoMap) {
  const nlohmann::json report = report_of({"surface_reflectance", "principal_point"}, 19402).json;
  EXPECT_EQ(names_in(report), (Names{"principal_point", "surface_reflectance"})) << report.at("summary");
}

/// Without the exponent of the warm-up the wander of the camera grows to all that is allowed, and its signs, turned, do
/// as much as the exponent.
TEST(HiddenPairs, ARailThatIsOffBesideAWarmUp) {
  const nlohmann::json report = report_of({"warm_up", "rail_offset"}, 217009).json;
  EXPECT_EQ(report.at("verdict"), "tie") << report.at("summary");
  EXPECT_EQ(names_in(report), (Names{"integration_time_offset", "rail_offset", "zero_offset"}));
}

}  // namespace
}  // namespace tofgraph::hidden
