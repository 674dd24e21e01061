// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Residuals of the bundle adjustment and their derivatives, for Ceres. The only header that needs Ceres.
#pragma once

#include "calibration/bundle.hpp"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <numbers>

namespace tofgraph::calibration::cost {

/// Pose relative to a fixed rotation: rotation vector, translation, shift of the distances.
using PoseParameters = std::array<double, 7>;

/// Point of the board including its warp.
struct BentPoint {
  double x = 0, y = 0;
  std::array<double, 3> basis{};
};

template <class T> T bent(const T* warp, const std::array<double, 3>& basis) {
  return warp[0] * basis[0] + warp[1] * basis[1] + warp[2] * basis[2];
}

/// Transforms from the board's frame to the camera's.
template <class T> void to_camera(const double* rotation, const T* pose, const T* board, T* camera) {
  T turned[3];
  for (int i = 0; i < 3; ++i)
    turned[i] = rotation[3 * i] * board[0] + rotation[3 * i + 1] * board[1] + rotation[3 * i + 2] * board[2];
  ceres::AngleAxisRotatePoint(pose, turned, camera);
  for (int i = 0; i < 3; ++i) camera[i] += pose[3 + i];
}

/// Transforms a direction from the camera's frame to the board's.
template <class T> void to_board(const double* rotation, const T* pose, const T* camera, T* board) {
  const T back[3] = {-pose[0], -pose[1], -pose[2]};
  T turned[3];
  ceres::AngleAxisRotatePoint(back, camera, turned);
  for (int i = 0; i < 3; ++i)
    board[i] = rotation[i] * turned[0] + rotation[3 + i] * turned[1] + rotation[6 + i] * turned[2];
}

/// Observed minus predicted position of a corner, whitened by the inverse Cholesky factor of its covariance.
struct CornerResidual {
  double u, v;
  std::array<double, 3> white;  ///< lower triangular: 00, 10, 11
  BentPoint point;
  double radius;           ///< of the circle; 0: a corner
  const double* rotation;  ///< fixed part of the pose

  template <class T> bool operator()(const T* lens, const T* warp, const T* pose, T* residual) const {
    T pixel[2];
    if (!predict(lens, warp, pose, pixel)) return false;
    const T du = u - pixel[0], dv = v - pixel[1];
    residual[0] = white[0] * du;
    residual[1] = white[1] * du + white[2] * dv;
    return true;
  }

  template <class T> bool predict(const T* lens, const T* warp, const T* pose, T* pixel) const {
    if (radius > 0) return centroid(lens, warp, pose, pixel);
    return image_of(lens, warp, pose, 0, 0, pixel);
  }

 private:
  template <class T> bool image_of(const T* lens, const T* warp, const T* pose, double dx, double dy, T* pixel) const {
    const T board[3] = {T(point.x + dx), T(point.y + dy), bent(warp, point.basis)};
    T camera[3];
    to_camera(rotation, pose, board, camera);
    if (!(camera[2] > 1e-6)) return false;
    project(lens, camera, pixel);
    return true;
  }

  /// Centroid of the imaged circle, which differs from the image of its centre: that of a polygon along its rim.
  template <class T> bool centroid(const T* lens, const T* warp, const T* pose, T* pixel) const {
    constexpr int sides = 16;
    T rim[sides][2], centre[2], area(0.0), moment[2] = {T(0.0), T(0.0)};
    if (!image_of(lens, warp, pose, 0, 0, centre)) return false;
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * std::numbers::pi * i / sides;
      if (!image_of(lens, warp, pose, radius * std::cos(angle), radius * std::sin(angle), rim[i])) return false;
      for (int k = 0; k < 2; ++k) rim[i][k] -= centre[k];
    }
    for (int i = 0; i < sides; ++i) {
      const T* a = rim[i];
      const T* b = rim[(i + 1) % sides];
      const T cross = a[0] * b[1] - a[1] * b[0];
      area += cross;
      for (int k = 0; k < 2; ++k) moment[k] += cross * (a[k] + b[k]);
    }
    for (int k = 0; k < 2; ++k) pixel[k] = centre[k] + moment[k] / (3.0 * area);
    return true;
  }
};

/// D of a point in the optical frame by the imaging model of physics/geometry, with derivatives by its arguments.
inline double half_path_of(const physics::Geometry& geometry, const double* point) {
  const physics::Vector3 p{point[0], point[1], point[2]};
  const double length = physics::norm(p);
  return physics::distance_at(geometry, (1 / length) * p, length);
}
inline double half_path(const LightPaths& light, const double* point, const double& focal_length) {
  return half_path_of({focal_length, light.sources}, point);
}
template <class T> T half_path(const LightPaths& light, const T* point, const T& focal_length) {
  physics::Geometry geometry{focal_length.a, light.sources};
  double at[3] = {point[0].a, point[1].a, point[2].a};
  T result(half_path_of(geometry, at));
  constexpr double step = 1e-5;  // m; central differences of lengths of about 1 m, relative error 1e-10
  for (int i = 0; i < 4; ++i) {
    double& argument = i < 3 ? at[i] : geometry.focal_length;
    const double centre = argument;
    argument = centre + step;
    const double above = half_path_of(geometry, at);
    argument = centre - step;
    const double below = half_path_of(geometry, at);
    argument = centre;
    result.v += (above - below) / (2 * step) * (i < 3 ? point[i].v : focal_length.v);
  }
  return result;
}

/// Measured minus predicted distance from a pixel along its ray to the warped board.
struct DistanceResidual {
  double u, v, distance, sd;
  std::array<double, 2> half_extent;  ///< of the board, where the warps are 1
  bool isotropic;
  const LightPaths* light;
  const double* rotation;

  template <class T> bool operator()(const T* lens, const T* warp, const T* range, const T* pose, T* residual) const {
    T predicted;
    if (!predict(lens, warp, range, pose, &predicted)) return false;
    residual[0] = (distance - predicted) / sd;
    return true;
  }

  template <class T> bool predict(const T* lens, const T* warp, const T* range, const T* pose, T* predicted) const {
    T ray[3];
    if (!ray_of(lens, ray)) return false;
    const T focal_length = (lens[lens::fx] * light->pitch[0] + lens[lens::fy] * light->pitch[1]) / 2.0;
    T path;
    if (!path_of(ray, focal_length, warp, pose, &path)) return false;
    *predicted = path * (1.0 + range[1]) + range[0] + pose[6];
    return true;
  }

  /// True half path along a ray, whose third component is 1, to the board.
  template <class T> bool path_of(const T* ray, const T& focal_length, const T* warp, const T* pose, T* path) const {
    const T back[3] = {-pose[3], -pose[4], -pose[5]};
    T direction[3], camera[3];
    to_board(rotation, pose, ray, direction);
    to_board(rotation, pose, back, camera);
    T along = -camera[2] / direction[2];
    for (int i = 0; i < 2; ++i) {  // the warp is small: two iterations are sufficient
      const T a = (camera[0] + along * direction[0]) / half_extent[0];
      const T b = (camera[1] + along * direction[1]) / half_extent[1];
      const T height =
          isotropic ? T(warp[0] * (a * a + b * b)) : T(warp[0] * a * a + warp[1] * b * b + warp[2] * a * b);
      along = (height - camera[2]) / direction[2];
    }
    if (!(along > 0.0)) return false;
    const T point[3] = {along * ray[0], along * ray[1], along * ray[2]};
    *path = half_path(*light, point, focal_length);
    return true;
  }

 private:
  static double scalar(double x) { return x; }
  template <class T> static double scalar(const T& x) { return x.a; }

  /// Ray of the pixel: Newton's method on plain numbers, then one step with derivatives.
  template <class T> bool ray_of(const T* lens, T* ray) const {
    LensParameters plain;
    for (std::size_t i = 0; i < plain.size(); ++i) plain[i] = scalar(lens[i]);
    double xy[2];
    if (!unproject(plain, u, v, xy)) return false;
    const std::array<double, 4> j = plane_jacobian(plain, xy[0], xy[1]);
    const double determinant = j[0] * j[3] - j[1] * j[2];
    T pixel[2];
    project_plane<T>(lens, T(xy[0]), T(xy[1]), pixel);
    const T du = u - pixel[0], dv = v - pixel[1];
    ray[0] = xy[0] + (j[3] * du - j[1] * dv) / determinant;
    ray[1] = xy[1] + (j[0] * dv - j[2] * du) / determinant;
    ray[2] = T(1.0);
    return true;
  }
};

/// Residual of a corner with derivatives in closed form: several times faster than automatic differentiation, which
/// propagates all 23 unknowns through each operation.
class CornerCost : public ceres::SizedCostFunction<2, lens::count, 3, 7> {
 public:
  explicit CornerCost(const CornerResidual& residual) : residual_(residual) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  CornerResidual residual_;
};

/// Residual of a distance. Its path depends on 12 numbers with automatic derivatives: the ray, the focal length, the
/// warp and the pose; the derivatives of the ray with respect to the lens are in closed form.
class DistanceCost : public ceres::SizedCostFunction<1, lens::count, 3, 2, 7> {
 public:
  explicit DistanceCost(const DistanceResidual& residual) : residual_(residual) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  DistanceResidual residual_;
};

/// Prior of a shift or a scale that is expected to be small.
struct Prior {
  double sd;
  int index;
  template <class T> bool operator()(const T* values, T* residual) const {
    residual[0] = values[index] / sd;
    return true;
  }
};

}  // namespace tofgraph::calibration::cost
