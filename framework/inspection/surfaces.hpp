// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Smooth surfaces in an image of lengths. No lens and no type of length is assumed: a wall that a wrong lens bends is
/// one surface; edges and creases end it.
#pragma once

#include "inspection/observation.hpp"

#include <vector>

namespace tofgraph::inspection {

/// Square part of the image, fitted by one slanted surface.
struct Block {
  std::size_t column = 0, row = 0;  ///< central pixel
  double length = 0;                ///< at the central pixel, from the fit to all pixels, m
  double noise = 0;                 ///< standard deviation of `length`, m
  double amplitude = 0;             ///< at the central pixel, mean of the frames, counts; NaN: not recorded
  double slope_x = 0, slope_y = 0;  ///< relative change of the length per focal length in the image
  std::size_t surface = 0;          ///< from 0
};

struct Surfaces {
  std::vector<Block> blocks;  ///< of sufficiently large surfaces
  std::size_t count = 0;      ///< number of surfaces
  std::size_t side = 0;       ///< side of a block, px
  double pixel_noise = 0;     ///< median standard deviation of pixels of the mean frame, m
  std::vector<double> rest;   ///< per pixel: length minus fit of its block, m; NaN: no block
};

Surfaces surfaces_of(const Observation& observation);

}  // namespace tofgraph::inspection
