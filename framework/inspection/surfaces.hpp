// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Smooth surfaces of an image of lengths. Nothing is assumed about the lens or about what the lengths are: a wall that
/// a wrong lens bends is one surface, an edge or a crease ends it.
#pragma once

#include "inspection/observation.hpp"

#include <vector>

namespace tofgraph::inspection {

/// A square part of the image, seen as one slanted surface.
struct Block {
  std::size_t column = 0, row = 0;  ///< its middle pixel
  double length = 0;                ///< there, by a fit to all its pixels, m
  double noise = 0;                 ///< standard deviation of the length, m
  double amplitude = 0;             ///< mean, counts; NaN: not recorded
  double slope_x = 0, slope_y = 0;  ///< relative change of the length per focal length of the image
  std::size_t surface = 0;          ///< from 0
};

struct Surfaces {
  std::vector<Block> blocks;  ///< of surfaces that are large enough
  std::size_t count = 0;      ///< of surfaces
  std::size_t side = 0;       ///< of a block, px
  double pixel_noise = 0;     ///< median standard deviation of a pixel of the mean frame, m
  std::vector<double> rest;   ///< per pixel: length minus the fit of its block, m; NaN: in no block
};

Surfaces surfaces_of(const Observation& observation);

}  // namespace tofgraph::inspection
