// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// A wrong square size, detected from the camera's distance measurements of the board.
#include "calibration/lens_distances.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace tofgraph::calibration {
namespace {

/// Frontal views of a board, which the corners place at `scale` times its true distance; the camera's distances have an
/// offset and wiggling.
std::string said(double scale, std::initializer_list<double> distances, double offset = 0.028) {
  Observations observations{
      .light = LightPaths{.sources = {{{0.05, 0, 0}, 0.5}, {{-0.05, 0, 0}, 0.5}}, .pitch = {4e-5, 4e-5}}};
  LensSolution corners;
  corners.lens[lens::fx] = corners.lens[lens::fy] = 320;
  corners.lens[lens::cx] = corners.lens[lens::cy] = 101.5;
  for (const double z : distances) {
    View view;
    for (const double u : {60.0, 101.5, 140.0}) {
      // Lamps beside the sensor, lens 12.8 mm before it; z from the lens.
      const double x = (u - 101.5) / 320 * z, depth = z + 0.0128;
      const double half = ((std::hypot(x - 0.05, depth) + std::hypot(x + 0.05, depth)) / 2 + std::hypot(x, z) +
                           0.0128 * std::hypot(x, z) / z) /
                          2;
      view.distances.push_back({u, 101.5, half + offset + 0.008 * std::sin(half * 2 * M_PI / 1.87), 1e-3});
    }
    corners.views.push_back({.view = observations.views.size(), .pose = {.translation = {0, 0, scale * z}}});
    observations.views.push_back(view);
  }
  return square_problem(corners, observations, 0.025);
}

TEST(LensSquare, SquaresThatAreTooSmallAreNamedWithTheSizeThatFits) {
  const std::string text = said(25.0 / 30, {0.45, 0.6, 0.75, 0.9});
  EXPECT_NE(text.find("Squares of 30 mm would fit the distances, the campaign says 25 mm"), std::string::npos) << text;
}

TEST(LensSquare, AnOffsetAndWigglingAreNoOtherSize) {
  EXPECT_EQ(said(1, {0.45, 0.6, 0.75, 0.9}), "");
  EXPECT_EQ(said(1, {0.45, 0.6, 0.75, 0.9}, 0.2), "") << "an offset of 200 mm is the camera's";
}

TEST(LensSquare, AtOneDistanceALargeDifferenceIsNamed) {
  EXPECT_NE(said(25.0 / 30, {0.6, 0.61, 0.62}), "");
  EXPECT_EQ(said(1, {0.6, 0.61, 0.62}), "");
}

}  // namespace
}  // namespace tofgraph::calibration
