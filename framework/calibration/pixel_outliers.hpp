// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Rejection of pixels that differ from their neighbours, before averaging over pixels.
#pragma once

#include "calibration/board_measurement.hpp"

#include <cstddef>
#include <span>
#include <vector>

namespace tofgraph::calibration {

/// Quantile of a variance of normal samples relative to its expectation, at a standard normal deviate: the
/// approximation of Wilson and Hilferty to chi-square / freedom. A deviate of 6 is exceeded with probability 1e-9.
double variance_ratio_at(double freedom, double deviate);

/// Deviate of all limits in this file: a good pixel with normal noise exceeds it with a probability of 1e-9 on each
/// side.
inline constexpr double outlier_deviate = 6;

/// Quantile of the neighbours up to two pixels away; NaN if fewer than four of them are finite.
/// @param image rows x columns @param share 0.5: median, for an even number the upper of the middle two
double neighbour_quantile(std::span<const double> image, std::size_t columns, std::size_t pixel, double share = 0.5);

/// Standard deviation of differences about 0 from the median of their magnitudes; NaN if none is finite.
double robust_sd(std::span<const double> differences);

/// Images of a flat target, one value for each of `pixels`.
struct FlatTarget {
  std::span<const std::size_t> pixels;
  std::span<const double> residual;   ///< m, measured minus modelled distance; empty: not modelled
  std::span<const double> amplitude;  ///< counts; empty: unknown
  std::span<const double> variance;   ///< m^2, of the distance in one frame; empty: one frame
  double freedom = 0;                 ///< per variance
  double range = 0;                   ///< m, unambiguous range
  std::size_t columns = 0;            ///< of the sensor
};

/// Tests each pixel against its neighbours up to two pixels away; a pixel with fewer than four neighbours is kept.
/// Rejects pixels whose amplitude differs by a factor of 4 or more from the upper quartile of the neighbours'; then,
/// relative to the medians of the remaining neighbours, pixels whose standard deviation is more than twice as large
/// and significantly so; and pixels whose residual differs by 10 mm or more, and by more than 6 robust standard
/// deviations of such differences, which are larger where the amplitude is smaller.
/// @param counts is increased by the numbers of rejected pixels, by reason
/// @returns for each pixel 1: keep, 0: rejected
std::vector<std::uint8_t> keep_like_neighbours(const FlatTarget& target, UnusablePixels& counts);

/// Marks isolated pixels of an image of any scene as NaN: those that differ from at least six of their eight neighbours
/// in the same direction by a factor of 3 and by more than 6 times the noise. Edges and corners of a pattern have more
/// similar neighbours.
/// @param noise of a pixel; NaN: unknown @returns number of marked pixels
std::size_t mark_isolated(std::vector<double>& values, std::size_t columns, double noise);

}  // namespace tofgraph::calibration
