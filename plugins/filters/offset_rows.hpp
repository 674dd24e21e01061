// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Data of the vector code of offset_correction: pointers to one row of pixels.
#pragma once

#include <tofgraph/physics/bistatic_tables.hpp>

#include <cstddef>
#include <cstdint>

namespace tofgraph {

/// A row of an image on its way through the correction.
struct OffsetRow {
  std::size_t columns, first;  ///< pixels, and the index of the first one in the image
  float* distance;             ///< m, is corrected
  const float* amplitude;      ///< counts; null: not used
  const float *sensor_path, *mean_along, *cosine, *brightness;
  const physics::BistaticSource* sources;
  std::size_t source_count;
  float focal_length, mean_square;  ///< m, m^2
  float rate;                       ///< 1/s, of the integration time
  float *depth, *reflectivity;      ///< pixels' values, then their means
  float* path;                      ///< m, D_ref
  std::int32_t* beyond;             ///< 1: the offset is an extrapolation
};

/// A row whose pixels are averaged with those `step` floats before and after them.
struct AverageRow {
  std::size_t columns;
  std::ptrdiff_t step, half;
  float depth_limit, limit;  ///< relative differences of depth and reflectivity within one surface
  const float *depth, *reflectivity;
  float *mean_depth, *mean_reflectivity;
};

/// The errors T - z at one integration time, depths x levels, and the reflectivities that are no extrapolation.
struct OffsetPlane {
  static constexpr int step_bits = 16;  ///< used of a float's 23 digits: 2^7 steps an octave
  std::int32_t depths, levels;
  float first, per_metre;        ///< m, 1/m: of the depths
  std::int32_t base, last_bits;  ///< levels: the bits of the lowest reflectivity, the largest difference from it
  const float* errors;           ///< m; one number more than there are nodes
  const float *least, *most;     ///< reflectivities, one a depth
};

}  // namespace tofgraph
