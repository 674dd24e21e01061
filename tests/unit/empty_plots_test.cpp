// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Plots without a single drawable point, and scales.
#include "report/chart.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tofgraph::report {
namespace {

TEST(EmptyPlot, SaysThatThereIsNoData) {
  const double nan = std::nan("");
  const Series none{.name = "none"}, unknown{.name = "unknown", .marks = {{1, nan}, {2, nan}}},
      negative{.name = "negative", .style = Series::Style::points, .marks = {{-1, 1}, {0, 2}}};
  for (const std::vector<Series>& drawn :
       {std::vector<Series>{}, std::vector<Series>{none}, std::vector<Series>{none, unknown}}) {
    EXPECT_NE(chart({.title = "t", .x_label = "x", .y_label = "y", .series = drawn}, 300, 200).find("no data"),
              std::string::npos);
  }
  EXPECT_NE(chart({.title = "t", .series = {negative}, .logarithmic_x = true}, 300, 200).find("no data"),
            std::string::npos);
}

TEST(EmptyPlot, CurvesWithPointsAreDrawnBesideThoseWithout) {
  const Series none{.name = "none"}, some{.name = "some", .marks = {{1, 3}, {2, 4}}};
  const std::string svg = chart({.title = "t", .series = {none, some}}, 300, 200);
  EXPECT_EQ(svg.find("no data"), std::string::npos);
  EXPECT_NE(svg.find("some"), std::string::npos);
}

TEST(EmptyPlot, AMapOfUnknownValuesIsDrawn) {
  const std::vector<double> unknown(12, std::nan(""));
  EXPECT_NE(field_map({.title = "t", .rows = 3, .columns = 4, .fields = fields_of(unknown)}, 300, 200).find("</svg>"),
            std::string::npos);
}

TEST(PlotAxis, OfTimesBeginsAtZero) {
  const Series series{.name = "series", .marks = {{0.5, 3}, {240, 2}, {480, 1}}};
  const std::string svg = chart({.title = "t", .x_label = "min", .series = {series}}, 500, 300);
  EXPECT_EQ(svg.find("-50"), std::string::npos);
  EXPECT_EQ(svg.find("−50"), std::string::npos);
}

/// The numbers of a short range far from zero differ.
TEST(PlotAxis, NumbersHaveTheDigitsThatDistinguishThem) {
  const Series series{.name = "s", .marks = {{100000.01, 1}, {100000.05, 2}}};
  const std::string svg = chart({.title = "t", .series = {series}}, 500, 300);
  EXPECT_NE(svg.find(">100000.02</text>"), std::string::npos);
  EXPECT_NE(svg.find(">100000.03</text>"), std::string::npos);
}

/// Equal factors are equally long.
TEST(LogarithmicAxis, HasItsDecadesAtEqualDistances) {
  const Series series{.name = "s", .style = Series::Style::points, .marks = {{1, 0}, {10, 1}, {100, 2}}};
  const std::string svg = chart({.title = "t", .series = {series}, .logarithmic_x = true}, 500, 300);
  std::vector<double> places;
  for (std::size_t at = svg.find("<circle"); at != std::string::npos; at = svg.find("<circle", at + 1))
    places.push_back(std::stod(svg.substr(svg.find("cx=\"", at) + 4)));
  ASSERT_EQ(places.size(), 4U) << "three marks and the legend's";
  EXPECT_NEAR(places[1] - places[0], places[2] - places[1], 0.11);
  EXPECT_GT(places[1], places[0]);
}

TEST(LogarithmicMap, TheMiddleOfTheScaleIsTheGeometricMean) {
  const std::vector<double> values = {1, 10, 100, std::nan("")};
  FieldMap map{.title = "t", .rows = 1, .columns = 4, .fields = fields_of(values), .signed_values = false};
  const std::string linear = field_map(map, 300, 200);
  map.logarithmic = true;
  const std::string logarithmic = field_map(map, 300, 200);
  EXPECT_NE(linear.find(">50.5</text>"), std::string::npos);
  EXPECT_NE(logarithmic.find(">10.0</text>"), std::string::npos);
  const std::vector<double> none = {std::nan(""), std::nan("")};
  map.fields = fields_of(none);
  map.columns = 2;
  EXPECT_NE(field_map(map, 300, 200).find("</svg>"), std::string::npos) << "nothing to draw";
}

}  // namespace
}  // namespace tofgraph::report
