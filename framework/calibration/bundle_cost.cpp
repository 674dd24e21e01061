// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/bundle_cost.hpp"

#include <Eigen/Core>
#include <Eigen/LU>

namespace tofgraph::calibration::cost {
namespace {

template <int rows, int columns> using Rows = Eigen::Matrix<double, rows, columns, Eigen::RowMajor>;
/// Derivatives with respect to the lens parameters.
using ByLens = Rows<2, static_cast<int>(lens::count)>;

template <class Matrix> Eigen::Map<Matrix> matrix_at(double* values) { return Eigen::Map<Matrix>(values); }

LensParameters lens_of(const double* parameters) {
  LensParameters lens{};
  std::copy_n(parameters, lens.size(), lens.begin());
  return lens;
}

ByLens by_lens(const LensParameters& lens, double x, double y) {
  const std::array<LensParameters, 2> derivatives = lens_jacobian(lens, x, y);
  ByLens result;
  for (int row = 0; row < 2; ++row)
    result.row(row) =
        Eigen::Map<const Rows<1, static_cast<int>(lens::count)>>(derivatives[static_cast<std::size_t>(row)].data());
  return result;
}

Eigen::Matrix2d by_plane(const LensParameters& lens, double x, double y) {
  return Eigen::Map<const Rows<2, 2>>(plane_jacobian(lens, x, y).data());
}

/// Rotates a point by a small rotation. @param by_rotation derivatives with respect to the rotation vector
Eigen::Vector3d turned_by(const double* small, const Eigen::Vector3d& point, Eigen::Matrix3d& by_rotation) {
  using Jet = ceres::Jet<double, 3>;
  const Jet vector[3] = {{small[0], 0}, {small[1], 1}, {small[2], 2}},
            from[3] = {Jet(point[0]), Jet(point[1]), Jet(point[2])};
  Jet to[3];
  ceres::AngleAxisRotatePoint(vector, from, to);
  Eigen::Vector3d result;
  for (int i = 0; i < 3; ++i) {
    result[i] = to[i].a;
    by_rotation.row(i) = to[i].v.transpose();
  }
  return result;
}

}  // namespace

bool CornerCost::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const double *warp = parameters[1], *pose = parameters[2];
  if (!residual_(parameters[0], warp, pose, residuals)) return false;
  if (jacobians == nullptr) return true;
  const LensParameters lens = lens_of(parameters[0]);
  const Eigen::Map<const Rows<3, 3>> rotation(residual_.rotation);
  const BentPoint& point = residual_.point;
  Eigen::Matrix3d by_rotation, unused;
  const Eigen::Vector3d camera =
      turned_by(pose, rotation * Eigen::Vector3d(point.x, point.y, bent(warp, point.basis)), by_rotation) +
      Eigen::Map<const Eigen::Vector3d>(pose + 3);
  const Eigen::Vector3d by_height = turned_by(pose, rotation.col(2), unused);
  const double x = camera.x() / camera.z(), y = camera.y() / camera.z();
  Rows<2, 3> plane_by_point;
  plane_by_point << 1, 0, -x, 0, 1, -y;
  Eigen::Matrix2d white;  // the residual is observed minus predicted
  white << -residual_.white[0], 0, -residual_.white[1], -residual_.white[2];
  const Rows<2, 3> by_point = white * by_plane(lens, x, y) * plane_by_point / camera.z();
  if (jacobians[0] != nullptr) matrix_at<ByLens>(jacobians[0]) = white * by_lens(lens, x, y);
  if (jacobians[1] != nullptr)
    matrix_at<Rows<2, 3>>(jacobians[1]) = by_point * by_height * Eigen::Map<const Rows<1, 3>>(point.basis.data());
  if (jacobians[2] != nullptr) {
    Eigen::Map<Rows<2, 7>> by_pose(jacobians[2]);
    by_pose.leftCols<3>() = by_point * by_rotation;
    by_pose.middleCols<3>(3) = by_point;
    by_pose.col(6).setZero();
  }
  return true;
}

bool DistanceCost::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const double *warp = parameters[1], *range = parameters[2], *pose = parameters[3];
  if (jacobians == nullptr) return residual_(parameters[0], warp, range, pose, residuals);
  const LensParameters lens = lens_of(parameters[0]);
  double xy[2];
  if (!unproject(lens, residual_.u, residual_.v, xy)) return false;
  using Jet = ceres::Jet<double, 12>;
  enum : int { ray_x, ray_y, focal, first_warp, first_pose = first_warp + 3 };
  const auto& pitch = residual_.light->pitch;
  const Jet ray[3] = {{xy[0], ray_x}, {xy[1], ray_y}, Jet(1.0)};
  const Jet focal_length((lens[lens::fx] * pitch[0] + lens[lens::fy] * pitch[1]) / 2, focal);
  Jet warps[3], poses[6], path;
  for (int i = 0; i < 3; ++i) warps[i] = Jet(warp[i], first_warp + i);
  for (int i = 0; i < 6; ++i) poses[i] = Jet(pose[i], first_pose + i);
  if (!residual_.path_of(ray, focal_length, warps, poses, &path)) return false;
  residuals[0] = (residual_.distance - (path.a * (1 + range[1]) + range[0] + pose[6])) / residual_.sd;
  const Rows<1, 12> by = -(1 + range[1]) / residual_.sd * path.v.transpose();
  if (jacobians[0] != nullptr) {
    // The pixel of the ray is fixed: the ray compensates every change of the lens.
    Eigen::Map<Rows<1, static_cast<int>(lens::count)>> by_parameters(jacobians[0]);
    by_parameters = -by.leftCols<2>() * by_plane(lens, xy[0], xy[1]).inverse() * by_lens(lens, xy[0], xy[1]);
    by_parameters[lens::fx] += by[focal] * pitch[0] / 2;
    by_parameters[lens::fy] += by[focal] * pitch[1] / 2;
  }
  if (jacobians[1] != nullptr) matrix_at<Rows<1, 3>>(jacobians[1]) = by.middleCols<3>(first_warp);
  if (jacobians[2] != nullptr) {
    jacobians[2][0] = -1 / residual_.sd;
    jacobians[2][1] = -path.a / residual_.sd;
  }
  if (jacobians[3] != nullptr) {
    matrix_at<Rows<1, 6>>(jacobians[3]) = by.middleCols<6>(first_pose);
    jacobians[3][6] = -1 / residual_.sd;
  }
  return true;
}

}  // namespace tofgraph::calibration::cost
