// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Board that fills the image: the scene of rail measurements and gap searches.
#pragma once

#include "simulation/files/pose.hpp"
#include "simulation/hit.hpp"

namespace tofgraph::simulation {

/// Pose and reflectivity; see physics::board for the frame.
struct BoardPose {
  double distance = 0.5;          ///< m from the sensor plane, on the axis
  double tilt_x = 0, tilt_y = 0;  ///< rad
  double reflectivity = 0.85;
  double roll = 0;      ///< rad, of the camera about its axis
  double velocity = 0;  ///< m/s along z, positive away from the camera
};

inline Tracer board_tracer(double focal_length, const BoardPose& board) {
  return [focal_length, board](const BoardChange& change, std::span<const Vector3> rays, std::span<Hit> hits) {
    const physics::Geometry geometry{focal_length, {}};
    const double distance =
        change.scale * board.distance + change.offset + change.displacement + change.time * board.velocity;
    physics::Plane plane = physics::board(distance, board.tilt_x, board.tilt_y);
    plane.normal = rotation(change.tilt_x, change.tilt_y, 0) * plane.normal;
    plane.offset = distance * plane.normal.z;
    if (board.roll != 0) plane.normal = rotation(0, 0, -board.roll) * plane.normal;  // seen by the rolled camera
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const double return_path = physics::reflected_path(geometry, rays[i], plane);
      if (!(return_path > 0)) continue;
      const Vector3 normal = physics::dot(plane.normal, rays[i]) > 0 ? -1.0 * plane.normal : plane.normal;
      hits[i] = {return_path, physics::point_on_ray(geometry, rays[i], return_path), normal, board.reflectivity, 0,
                 nullptr};
    }
  };
}

}  // namespace tofgraph::simulation
