// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/lens_linearisation.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

namespace tofgraph::calibration {
namespace {

using Matrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

}  // namespace

Eigen::Vector2d image_of(const LensParameters& lens, const Eigen::Vector3d& camera) {
  Eigen::Vector2d pixel;
  project<double>(lens.data(), camera.data(), pixel.data());
  return pixel;
}

bool derivatives_of(const LensSolution& solution, const Pose& pose, const BoardPoint& point,
                    const std::array<double, 3>& basis, PointDerivatives& result) {
  const Eigen::Map<const Matrix3> rotation(pose.rotation.data());
  const Eigen::Map<const Eigen::Vector3d> shift(pose.translation.data());
  const double height = solution.warp[0] * basis[0] + solution.warp[1] * basis[1] + solution.warp[2] * basis[2];
  const Eigen::Vector3d turned = rotation * Eigen::Vector3d(point.x, point.y, height), camera = turned + shift;
  if (!(camera.z() > 1e-6)) return false;
  result.pixel = image_of(solution.lens, camera);
  result.plane = camera.head<2>() / camera.z();
  const Layout& layout = solution.layout;
  result.shared.resize(2, static_cast<Eigen::Index>(layout.lens.size() + layout.warp));
  for (std::size_t i = 0; i < layout.lens.size(); ++i) {
    const std::size_t parameter = layout.lens[i];
    const double step = parameter <= lens::cy ? 1e-3 : 1e-6;
    LensParameters above = solution.lens, below = solution.lens;
    above[parameter] += step;
    below[parameter] -= step;
    result.shared.col(static_cast<Eigen::Index>(i)) = (image_of(above, camera) - image_of(below, camera)) / (2 * step);
  }
  Eigen::Matrix<double, 2, 3> place;
  const double step = 1e-6 * camera.z();
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d d = step * Eigen::Vector3d::Unit(i);
    place.col(i) = (image_of(solution.lens, camera + d) - image_of(solution.lens, camera - d)) / (2 * step);
  }
  for (int i = 0; i < 3; ++i) result.pose.col(i) = place * Eigen::Vector3d::Unit(i).cross(turned);
  result.pose.rightCols<3>() = place;
  result.height = place * rotation.col(2);
  for (std::size_t i = 0; i < layout.warp; ++i)
    result.shared.col(static_cast<Eigen::Index>(layout.lens.size() + i)) = result.height * basis[i];
  return true;
}

Eigen::Matrix2d whitening(const Corner& corner, double variance_factor) {
  Eigen::Matrix2d covariance;
  covariance << corner.covariance[0], corner.covariance[1], corner.covariance[1], corner.covariance[2];
  covariance *= variance_factor;
  const Eigen::LLT<Eigen::Matrix2d> factor(covariance);
  return factor.matrixL().solve(Eigen::Matrix2d::Identity());
}

}  // namespace tofgraph::calibration
