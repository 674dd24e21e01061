// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Plots without a single point that can be drawn.
#include "report/plot.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tofgraph::report {
namespace {

TEST(EmptyPlot, SaysThatThereIsNoData) {
  const double nan = std::nan("");
  const Curve none{.name = "none"}, unknown{.name = "unknown", .x = {1, 2}, .y = {nan, nan}},
      negative{.name = "negative", .x = {-1, 0}, .y = {1, 2}, .points = true};
  for (const std::vector<Curve>& drawn :
       {std::vector<Curve>{}, std::vector<Curve>{none}, std::vector<Curve>{none, unknown}}) {
    EXPECT_NE(curves({.title = "t", .x_label = "x", .y_label = "y", .curves = drawn}, 300, 200).find("no data"),
              std::string::npos);
  }
  EXPECT_NE(curves({.title = "t", .curves = {negative}, .logarithmic_x = true}, 300, 200).find("no data"),
            std::string::npos);
}

TEST(EmptyPlot, CurvesWithPointsAreDrawnBesideThoseWithout) {
  const Curve none{.name = "none"}, some{.name = "some", .x = {1, 2}, .y = {3, 4}};
  const std::string svg = curves({.title = "t", .curves = {none, some}}, 300, 200);
  EXPECT_EQ(svg.find("no data"), std::string::npos);
  EXPECT_NE(svg.find("some"), std::string::npos);
}

TEST(EmptyPlot, AMapOfUnknownValuesIsDrawn) {
  EXPECT_NE(heat_map({.title = "t", .rows = 3, .columns = 4, .values = std::vector<double>(12, std::nan(""))}, 300, 200)
                .find("</svg>"),
            std::string::npos);
}

}  // namespace
}  // namespace tofgraph::report
