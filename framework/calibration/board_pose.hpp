// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The pose of the camera before a calibration pattern.
#pragma once

#include "calibration/bundle.hpp"
#include "io/campaign.hpp"

#include <string>

namespace tofgraph::calibration {

/// The pattern is the world: its origin is the pattern's middle, x runs along its rows, y along its columns, z away
/// from the camera that faces it.
struct BoardPose {
  Pose board;              ///< T_camera_board
  Pose world_camera;       ///< T_world_camera, its inverse: p_world = R p_camera + t
  double rms = 0;          ///< px, of the reprojected points
  std::size_t points = 0;  ///< seen points of the pattern
  double distance = 0;     ///< m, from the camera's optical centre to the pattern's middle
  double tilt = 0;         ///< rad, of the pattern's normal against the optical axis
  std::string serial;      ///< camera's; empty: not recorded
};

/// Finds the pattern in the mean image of the campaign's first condition and solves for the pose with the profile's
/// lens (OpenCV's iterative solvePnP). A pattern that looks the same after a half turn, such as a chessboard of 8 x 6
/// inner corners, is taken with its rows running to the right in the image, so that all its poses are consistent.
/// @throws std::runtime_error the capture cannot be read, the pattern is not seen, or no pose fits
BoardPose pose_of(const io::Campaign& campaign);

}  // namespace tofgraph::calibration
