// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Plots without a single drawable point, and scales.
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

TEST(PlotAxis, OfTimesBeginsAtZero) {
  const Curve series{.name = "series", .x = {0.5, 240, 480}, .y = {3, 2, 1}};
  const std::string svg = curves({.title = "t", .x_label = "min", .curves = {series}}, 500, 300);
  EXPECT_EQ(svg.find("-50"), std::string::npos);
  EXPECT_EQ(svg.find("−50"), std::string::npos);
}

TEST(LogarithmicMap, IsDrawnOtherwiseAndAlsoWithoutValues) {
  HeatMap map{.title = "t", .rows = 1, .columns = 4, .values = {1, 10, 100, std::nan("")}, .signed_values = false};
  const std::string linear = heat_map(map, 300, 200);
  map.logarithmic = true;
  const std::string logarithmic = heat_map(map, 300, 200);
  EXPECT_NE(linear, logarithmic);
  map.values = {std::nan(""), std::nan("")};
  map.columns = 2;
  EXPECT_NE(heat_map(map, 300, 200).find("</svg>"), std::string::npos) << "nothing to draw";
}

}  // namespace
}  // namespace tofgraph::report
