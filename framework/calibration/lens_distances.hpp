// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Decision whether the measured distances of the board are used for the lens.
#pragma once

#include "calibration/bundle.hpp"

#include <string>

namespace tofgraph::calibration {

/// The lens from corners alone against that from corners and distances.
struct DistanceCheck {
  bool done = false;
  double statistic = 0, terms = 0, p_value = 1;  ///< test of the difference of both lenses
  double range_scale = 0;                        ///< relative, as fitted
  bool same_lens() const { return p_value > 1e-3; }
  bool plausible_scale() const;  ///< within three standard deviations of what is known beforehand
  bool fit() const { return same_lens() && plausible_scale(); }
  std::string reason() const;  ///< inconsistency; empty: none
};

/// Hausman's test (Econometrica 46, 1978): if the distances are right, the difference d of both lenses has the
/// covariance C_corners - C_joint, and d^T (C_corners - C_joint)^-1 d is a chi-square. Directions in which the
/// distances add next to nothing are left out.
/// @param corners from corners alone @param joint of the same views and options, with distances
DistanceCheck check_distances(const LensSolution& corners, const LensSolution& joint);

/// Why the measured distances are too far from those that the size of the squares gives, with the size that would fit;
/// empty: they are not. Offset and scale of the measured distances are told apart by the ranges of the views; a scale
/// beyond what cyclic errors make is that of the squares.
/// @param corners the lens from corners alone @param observations with the views' distances @param square m
std::string square_problem(const LensSolution& corners, const Observations& observations, double square);

}  // namespace tofgraph::calibration
