// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Data of the vector code of offset_correction: pointers to one row of pixels.
#pragma once

#include <tofgraph/physics/bistatic_tables.hpp>

#include <cstddef>
#include <cstdint>

namespace tofgraph {

/// Row of an image during the correction.
struct OffsetRow {
  std::size_t columns, first;  ///< number of pixels, and the image index of the first
  float* distance;             ///< m, corrected in place
  const float* amplitude;      ///< counts; null: unused
  const float *sensor_path, *mean_along, *cosine, *brightness;
  const physics::BistaticSource* sources;
  std::size_t source_count;
  float focal_length, mean_square;  ///< m, m^2
  float rate;                       ///< 1/s, inverse of the integration time
  float *depth, *reflectivity;      ///< values of the pixels, then their means
  float* path;                      ///< m, D_ref
  float* error;                     ///< m, T - z
  std::int32_t* beyond;             ///< 1: the offset is extrapolated
};

/// Row whose pixels are averaged with their neighbours at multiples of `step` floats.
struct AverageRow {
  std::size_t columns;
  std::ptrdiff_t step, half;
  float depth_limit, limit;  ///< maximum relative differences of depth and reflectivity within one surface
  const float *depth, *reflectivity;
  float *mean_depth, *mean_reflectivity;
};

/// Errors T - z at one integration time, depths x levels, and the range of reflectivities without extrapolation.
struct OffsetPlane {
  static constexpr int step_bits = 16;  ///< unused low digits of a float's 23: 2^7 steps per octave
  std::int32_t depths, levels;
  float first, per_metre;        ///< m, 1/m: depth of the first node, nodes per metre
  std::int32_t base, last_bits;  ///< levels: bits of the lowest reflectivity, and largest difference from it
  const float* errors;           ///< m; one more element than nodes; unused for scattered samples
  const float *least, *most;     ///< reflectivities, one per depth
};

/// Pixels of one cell of NearestOffsets and the samples that may be among their nearest, as differences from the centre
/// of the cell in the units of the search. Whole vectors of pixels are computed, up to the next multiple of `padding`.
struct NearestGroup {
  static constexpr std::size_t padding = 16;
  std::size_t pixels, samples;
  const float *depth, *reflectivity;  ///< of the pixels
  float* error;                       ///< m, computed
  float centre, per_metre;            ///< m, 1/m
  float inverse_reflectivity;         ///< of the centre
  float per_level;                    ///< units per 1 of ln reflectivity
  const float *depth_step, *level_step, *time_square, *sample_error;
};

}  // namespace tofgraph
