// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Pose of an object: rotation and position in the sensor frame.
#pragma once

#include <tofgraph/physics/geometry.hpp>

#include <cmath>

namespace tofgraph::simulation {

using physics::Vector3;

/// Right-handed rotation, stored as the images of the three axes.
struct Rotation {
  Vector3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};

  /// Transforms from the object's frame to the sensor frame.
  Vector3 operator*(Vector3 v) const { return v.x * x + v.y * y + v.z * z; }
  Rotation operator*(const Rotation& other) const { return {*this * other.x, *this * other.y, *this * other.z}; }
  /// Transforms from the sensor frame to the object's frame.
  Vector3 inverse(Vector3 v) const { return {dot(x, v), dot(y, v), dot(z, v)}; }
};

/// R_z(about_z) R_y(about_y) R_x(about_x), angles in rad; the rotation about x is first. With about_z = 0 this is the
/// R_y(tilt_y) R_x(tilt_x) of a board, and the axis z becomes the normal of physics::board.
inline Rotation rotation(double about_x, double about_y, double about_z) {
  const double sx = std::sin(about_x), cx = std::cos(about_x);
  const double sy = std::sin(about_y), cy = std::cos(about_y);
  const double sz = std::sin(about_z), cz = std::cos(about_z);
  return {{cz * cy, sz * cy, -sy},
          {cz * sy * sx - sz * cx, sz * sy * sx + cz * cx, cy * sx},
          {cz * sy * cx + sz * sx, sz * sy * cx - cz * sx, cy * cx}};
}

struct Pose {
  Vector3 position;  ///< m, of the object's origin
  Rotation rotation;
};

}  // namespace tofgraph::simulation
