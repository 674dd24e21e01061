// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Paths of rays: equations.md section 3, in the sensor frame (origin at the sensor's centre, z towards the
/// scene).
#pragma once

#include "tests/hidden_effects/plain_camera.hpp"

#include <cmath>

namespace tofgraph::hidden {

struct Vector {
  double x = 0, y = 0, z = 0;
};
inline Vector operator+(Vector a, Vector b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vector operator-(Vector a, Vector b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vector operator*(double s, Vector a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline double length(Vector a) { return std::sqrt(dot(a, a)); }
inline Vector unit(Vector a) { return 1 / length(a) * a; }

/// Right-handed rotations about one axis, angle in rad.
Vector about_x(double angle, Vector v);
Vector about_y(double angle, Vector v);
Vector about_z(double angle, Vector v);

/// The board in the camera frame: a point, the normal that points away from the camera, and the directions of its own
/// coordinates.
struct Plane {
  Vector point, normal, x, y;
};
Plane board_of(const Physics& physics, const View& view, double displacement);

/// Ray of one pixel, from the lens centre into the scene.
struct Ray {
  Vector direction;      ///< unit vector
  double to_sensor = 0;  ///< m, D_sen: lens centre -> pixel
  double cos_theta = 1;  ///< relative to the optical axis
};
/// Rays of all pixels, row by row.
std::vector<Ray> rays_of(const Physics& physics);

/// Positions of the two arrays: left, right.
std::array<Vector, 2> source_positions(const Physics& physics);
/// Mirror image of a source in the rail, which is fixed in the world, not in the camera.
Vector mirrored_by_rail(const Physics& physics, const View& view, Vector source);

}  // namespace tofgraph::hidden
