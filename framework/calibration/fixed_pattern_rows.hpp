// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Unknowns of the fixed-pattern fit and the rows of one pixel.
#pragma once

#include "calibration/fixed_pattern_priors.hpp"

#include <Eigen/Dense>

#include <vector>

namespace tofgraph::calibration::pattern {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

inline constexpr Eigen::Index per_view = 5, shapes = shape_terms.size(), waves = 2 * harmonics.size(),
                              commons = shapes + waves;

/// Rows of the equations that belong to one pixel.
struct Rows {
  Eigen::Index own = 2;                       ///< number of unknowns of the pixel: map, slope
  std::vector<Eigen::Index> view;             ///< per row
  std::vector<double> weight, residual, arm;  ///< 1/m^2, m, D - 2 m in m
  std::vector<Eigen::Matrix<double, per_view, 1>> pose;
  std::vector<Eigen::Matrix<double, commons, 1>> common;  ///< shape of the board, then the waves
};

using ViewUse = std::vector<char>;  ///< nonzero for views that are fitted

}  // namespace tofgraph::calibration::pattern
