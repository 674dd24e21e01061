// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Rays, light paths and the imaging model: the distance that a camera reports for a surface at a known position.
///
/// All vectors are in the sensor frame: origin at the centre of the sensor plane, z towards the scene, x along the
/// image row, y down the column; the lens centre is at (0, 0, focal_length). Lengths are metres.
#pragma once

#include <tofgraph/array.hpp>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace tofgraph::physics {

struct Vector3 {
  double x = 0, y = 0, z = 0;

  friend Vector3 operator+(Vector3 a, Vector3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend Vector3 operator-(Vector3 a, Vector3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend Vector3 operator*(double s, Vector3 a) { return {s * a.x, s * a.y, s * a.z}; }
};

inline double dot(Vector3 a, Vector3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline double norm(Vector3 a) { return std::sqrt(dot(a, a)); }

/// A light source with its fraction of the light: the weights of a camera's sources sum to 1.
struct WeightedSource {
  Vector3 position;
  double weight = 1;
};

/// Parameters of light paths that are common to all pixels.
struct Geometry {
  double focal_length = 0;  ///< m, sensor plane to lens centre
  std::vector<WeightedSource> sources;

  Vector3 lens_centre() const { return {0, 0, focal_length}; }
};

/// Geometry of a camera; the weights are the sources' amplitudes.
/// @throws std::invalid_argument naming what is missing: the focal length in metres, a source, light
inline Geometry geometry_of(const tofgraph_camera& camera) {
  const std::string name = std::string("the camera '") + (camera.name != nullptr ? camera.name : "") + "' ";
  if (!(camera.focal_length > 0)) {
    throw std::invalid_argument(
        name +
        "has no focal length in metres, which is needed for the paths of light: its profile must give "
        "lengths, e.g. pixel_pitch: 40 um and focal_length: 12.8 mm");
  }
  Geometry geometry{camera.focal_length, {}};
  double total = 0;
  for (const tofgraph_light& light : lights_of(camera)) {
    geometry.sources.push_back({{light.position[0], light.position[1], light.position[2]}, light.amplitude});
    total += light.amplitude;
  }
  if (!(total > 0)) {
    throw std::invalid_argument(name +
                                "has no light source, e.g. sources: [{name: lamp, position: [0 mm, 0 mm, 0 mm]}]");
  }
  for (WeightedSource& source : geometry.sources) source.weight /= total;
  return geometry;
}

/// Ray of a pixel from a camera's float table, renormalised to length 1 in double. NaN stays NaN.
inline Vector3 unit_ray(const float* ray) {
  const Vector3 v{ray[0], ray[1], ray[2]};
  return (1 / norm(v)) * v;
}

/// D_sen, lens centre to pixel: hypot(r_s, f) = f / cos(theta), equation (5.77).
inline double sensor_path(const Geometry& geometry, Vector3 ray) { return geometry.focal_length / ray.z; }

/// D_ref, surface to lens centre, of the point seen by the pixel at depth z from the sensor plane: (z - f)/cos(theta).
inline double reflected_path(const Geometry& geometry, Vector3 ray, double depth) {
  return (depth - geometry.focal_length) / ray.z;
}

/// Depth from the sensor plane of a point on the ray; the inverse of the above.
inline double depth_of(const Geometry& geometry, Vector3 ray, double return_path) {
  return geometry.focal_length + return_path * ray.z;
}

/// Point on the ray at this distance from the lens centre.
inline Vector3 point_on_ray(const Geometry& geometry, Vector3 ray, double return_path) {
  return geometry.lens_centre() + return_path * ray;
}

/// D_i, source to point.
inline double source_path(const WeightedSource& source, Vector3 point) { return norm(point - source.position); }

/// Mean path from the sources to the point, weighted by their light.
inline double mean_source_path(const Geometry& geometry, Vector3 point) {
  double sum = 0;
  for (const WeightedSource& source : geometry.sources) sum += source.weight * source_path(source, point);
  return sum;
}

/// Imaging model: D, half of the mean travelled path to the ray's point at D_ref, equations (5.86), (6.1).
inline double distance_at(const Geometry& geometry, Vector3 ray, double return_path) {
  const Vector3 point = point_on_ray(geometry, ray, return_path);
  return (mean_source_path(geometry, point) + return_path + sensor_path(geometry, ray)) / 2;
}

/// Imaging model for a perpendicular board at `depth` from the sensor plane.
inline double distance_at_depth(const Geometry& geometry, Vector3 ray, double depth) {
  return distance_at(geometry, ray, reflected_path(geometry, ray, depth));
}

/// Plane of the points P with dot(normal, P) = offset.
struct Plane {
  Vector3 normal;
  double offset = 0;
};

/// Board at `distance` from the sensor plane on the axis, rotated by R = R_y(tilt_y) R_x(tilt_x), right-handed.
/// @param tilt_x, tilt_y rad
inline Plane board(double distance, double tilt_x = 0, double tilt_y = 0) {
  const Vector3 normal{std::sin(tilt_y) * std::cos(tilt_x), -std::sin(tilt_x), std::cos(tilt_y) * std::cos(tilt_x)};
  return {normal, distance * normal.z};
}

/// D_ref of the intersection of the ray and the plane; NaN if there is none in front of the lens.
inline double reflected_path(const Geometry& geometry, Vector3 ray, const Plane& plane) {
  const double return_path = (plane.offset - dot(plane.normal, geometry.lens_centre())) / dot(plane.normal, ray);
  return return_path > 0 && std::isfinite(return_path) ? return_path : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace tofgraph::physics
