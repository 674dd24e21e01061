// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Rejection of pixels that are unlike their neighbours, before anything is averaged over pixels.
#pragma once

#include "calibration/board.hpp"

#include <cstddef>
#include <span>
#include <vector>

namespace tofgraph::calibration {

/// Quantile of a variance of normal samples over its expectation, at a standard normal deviate: the approximation of
/// Wilson and Hilferty to chi-square / freedom. A deviate of 6 is exceeded with a probability of 1e-9.
double variance_ratio_at(double freedom, double deviate);

/// Deviate of every limit of this file: a good pixel with normal noise exceeds it with a probability of 1e-9 on each
/// side.
inline constexpr double outlier_deviate = 6;

/// Quantile of the neighbours up to two pixels away; NaN where fewer than four of them are numbers.
/// @param image rows x columns @param share 0.5: the median, of an even number the upper one of the middle two
double neighbour_quantile(std::span<const double> image, std::size_t columns, std::size_t pixel, double share = 0.5);

/// Standard deviation of differences about 0 by the median of their sizes; NaN where none is a number.
double robust_sd(std::span<const double> differences);

/// Images of a flat target, one value for each of `pixels`.
struct FlatTarget {
  std::span<const std::size_t> pixels;
  std::span<const double> residual;   ///< m, measured minus modelled distance; empty: not modelled
  std::span<const double> amplitude;  ///< counts; empty: not known
  std::span<const double> variance;   ///< m^2, of the distance in one frame; empty: one frame
  double freedom = 0;                 ///< per variance
  double range = 0;                   ///< m, after which distances wrap
  std::size_t columns = 0;            ///< sensor's
};

/// Judges each pixel by its neighbours, up to two pixels away; a pixel with fewer than four neighbours is kept.
/// Rejected are pixels whose amplitude differs by a factor of 4 or more from the upper quartile of the neighbours';
/// then by the medians of the neighbours that are left, pixels whose standard deviation is more than twice the
/// neighbours', and more than chance allows; whose residual differs by 10 mm or more, and by more than 6 robust
/// standard deviations of such differences, which are larger where the amplitude is smaller.
/// @param counts is increased by what is rejected, by reason
/// @returns for each pixel 1: keep, 0: rejected
std::vector<std::uint8_t> keep_like_neighbours(const FlatTarget& target, UnusablePixels& counts);

/// Marks isolated pixels of an image of any scene as NaN: those that at least six of their eight neighbours exceed by a
/// factor of 3, or fall below by that factor, and by more than 6 times the noise. Edges and corners of a pattern have
/// more neighbours that are like them.
/// @param noise of a pixel; NaN: not known @returns number of pixels marked
std::size_t mark_isolated(std::vector<double>& values, std::size_t columns, double noise);

}  // namespace tofgraph::calibration
