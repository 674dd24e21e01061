// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Distances that depend on the amplitude: regressions within small square blocks, where a surface is a plane.
#pragma once

#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

namespace tofgraph::physics {

/// A pixel of a block.
struct WalkPixel {
  double u, v;  ///< px, from the middle of the block
  double log_amplitude;
  double length;  ///< m, or the residual of a fit
};

/// Sums of a regression of lengths on log(amplitude).
struct WalkSums {
  double xx = 0, xy = 0, n = 0;

  double slope() const { return xy / xx; }
  /// Standard deviation of log(amplitude).
  double contrast() const { return std::sqrt(xx / n); }
  void add(const WalkSums& other) { xx += other.xx, xy += other.xy, n += other.n; }
};

/// Sums of one block. Mean and slopes are removed from log(amplitude), so that those of the lengths cancel too.
inline WalkSums walk_in_block(const std::vector<WalkPixel>& pixels) {
  double mean = 0, xu = 0, xv = 0, uu = 0, vv = 0;
  for (const WalkPixel& p : pixels) {
    mean += p.log_amplitude / static_cast<double>(pixels.size());
    xu += p.log_amplitude * p.u, xv += p.log_amplitude * p.v, uu += p.u * p.u, vv += p.v * p.v;
  }
  WalkSums sums;
  for (const WalkPixel& p : pixels) {
    const double x = p.log_amplitude - mean - xu / uu * p.u - xv / vv * p.v;
    sums.xx += x * x;
    sums.xy += x * p.length;
    ++sums.n;
  }
  return sums;
}

/// Slope of distance against amplitude in one frame: median over the blocks with contrast, m per factor 2.
struct WalkOfFrame {
  double rise = 0, error = 0;  ///< error: standard deviation of the median
};

/// Evaluates the blocks of 9 x 9 px in which every pixel is valid. At depth edges nearer surfaces are brighter, so that
/// distances decrease with the amplitude: edges cannot imitate a positive slope.
/// @returns nullopt if fewer than 50 blocks have contrast
inline std::optional<WalkOfFrame> walk_of_frame(const float* distance, const float* amplitude, std::size_t rows,
                                                std::size_t columns) {
  constexpr std::size_t side = 9, min_blocks = 50;
  constexpr double min_contrast = 0.1, ln2 = 0.6931471805599453;
  std::vector<double> slopes;
  std::vector<WalkPixel> pixels;
  for (std::size_t top = 0; top + side <= rows; top += side) {
    for (std::size_t left = 0; left + side <= columns; left += side) {
      pixels.clear();
      for (std::size_t k = 0; k < side * side; ++k) {
        const std::size_t i = (top + k / side) * columns + left + k % side;
        if (!std::isfinite(distance[i]) || !(amplitude[i] > 0)) break;
        pixels.push_back({static_cast<double>(k % side) - side / 2, static_cast<double>(k / side) - side / 2,
                          std::log(static_cast<double>(amplitude[i])), static_cast<double>(distance[i])});
      }
      if (pixels.size() < side * side) continue;
      const WalkSums sums = walk_in_block(pixels);
      if (sums.contrast() > min_contrast) slopes.push_back(sums.slope() * ln2);
    }
  }
  if (slopes.size() < min_blocks) return std::nullopt;
  const double rise = median(slopes);
  for (double& slope : slopes) slope = std::abs(slope - rise);
  return WalkOfFrame{rise, 1.2533 * sd_of_deviations * median(slopes) / std::sqrt(static_cast<double>(slopes.size()))};
}

}  // namespace tofgraph::physics
