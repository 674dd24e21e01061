// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Decision whether the measured distances of the board are used for the lens.
#pragma once

#include "calibration/bundle.hpp"

#include <string>

namespace tofgraph::calibration {

/// Comparison of the lens from corners alone with that from corners and distances.
struct DistanceCheck {
  bool done = false;
  double statistic = 0, terms = 0, p_value = 1;  ///< test of the difference between the two lenses
  double range_scale = 0;                        ///< relative, as fitted
  bool same_lens() const { return p_value > 1e-3; }
  bool plausible_scale() const;  ///< within three standard deviations of the prior
  bool fit() const { return same_lens() && plausible_scale(); }
  std::string reason() const;  ///< inconsistency; empty: none
};

/// Hausman's test (Econometrica 46, 1978): if the distances are correct, the difference d of the two lenses has the
/// covariance C_corners - C_joint, and d^T (C_corners - C_joint)^-1 d is chi-square distributed. Directions in which
/// the distances add almost no information are excluded.
/// @param corners from corners alone @param joint from the same views and options, with distances
DistanceCheck check_distances(const LensSolution& corners, const LensSolution& joint);

/// Problem if the measured distances contradict those implied by the size of the squares, with the size that would fit;
/// empty: none. Offset and scale of the measured distances are separated by the ranges of the views; a scale beyond
/// that of cyclic errors is attributed to the squares.
/// @param corners lens from corners alone @param observations with the views' distances @param square m
std::string square_problem(const LensSolution& corners, const Observations& observations, double square);

}  // namespace tofgraph::calibration
