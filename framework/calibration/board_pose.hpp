// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Pose of the camera relative to a calibration pattern.
#pragma once

#include "calibration/bundle.hpp"
#include "io/campaign.hpp"

#include <string>

namespace tofgraph::calibration {

/// The world frame is that of the pattern: its origin is the pattern's centre, x is along its rows, y along its
/// columns, z points away from a camera that faces it.
struct BoardPose {
  Pose board;              ///< T_camera_board
  Pose world_camera;       ///< T_world_camera, its inverse: p_world = R p_camera + t
  double rms = 0;          ///< px, of the reprojection errors
  std::size_t points = 0;  ///< number of detected points of the pattern
  double distance = 0;     ///< m, from the camera's optical centre to the pattern's centre
  double tilt = 0;         ///< rad, between the pattern's normal and the optical axis
  std::string serial;      ///< of the camera; empty: not recorded
};

/// Detects the pattern in the mean image of the campaign's first condition and solves for the pose with the profile's
/// lens (OpenCV's iterative solvePnP). A pattern with half-turn symmetry, such as a chessboard of 8 x 6 inner corners,
/// is oriented so that its rows point to the right in the image, which makes all its poses consistent.
/// @throws std::runtime_error if the capture cannot be read, the pattern is not detected, or no pose fits
BoardPose pose_of(const io::Campaign& campaign);

}  // namespace tofgraph::calibration
