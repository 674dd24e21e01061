// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Derivatives of a projected board point by finite differences, for the validation of lenses.
#pragma once

#include "calibration/bundle.hpp"

#include <Eigen/Core>

#include <array>

namespace tofgraph::calibration {

/// Board point in a view: its image, and the derivatives with respect to the parameters.
struct PointDerivatives {
  Eigen::Vector2d pixel;
  Eigen::Vector2d plane;                            ///< on z = 1, without distortion
  Eigen::Matrix<double, 2, Eigen::Dynamic> shared;  ///< lens and warp, as in the layout
  Eigen::Matrix<double, 2, 6> pose;                 ///< rotation about the camera's axes, translation
  Eigen::Vector2d height;                           ///< px per m of the point's height above the board
};

/// Pixel at which a lens images a point of the camera's frame, in m.
Eigen::Vector2d image_of(const LensParameters& lens, const Eigen::Vector3d& camera);

/// @param basis of the warp at the point @returns false behind the camera
bool derivatives_of(const LensSolution& solution, const Pose& pose, const BoardPoint& point,
                    const std::array<double, 3>& basis, PointDerivatives& result);

/// Inverse Cholesky factor of a corner's covariance, scaled by the fit's scatter: whitens residuals and derivatives.
Eigen::Matrix2d whitening(const Corner& corner, double variance_factor);

}  // namespace tofgraph::calibration
