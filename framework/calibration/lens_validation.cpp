// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/lens_validation.hpp"

#include "calibration/interval.hpp"
#include "calibration/lens_linearisation.hpp"

#include <tbb/parallel_for.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>

namespace tofgraph::calibration {
namespace {

constexpr int grid = 11;  ///< number of image positions along each side at which lenses are compared
constexpr std::size_t max_folds = 5;

using Matrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

Eigen::Matrix<double, 2, 3> place_jacobian(const LensParameters& lens, const Eigen::Vector3d& camera) {
  Eigen::Matrix<double, 2, 3> jacobian;
  const double step = 1e-6 * camera.z();
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d d = step * Eigen::Vector3d::Unit(i);
    jacobian.col(i) = (image_of(lens, camera + d) - image_of(lens, camera - d)) / (2 * step);
  }
  return jacobian;
}

/// Subset of the views.
Observations subset(const Observations& all, const std::vector<std::size_t>& views) {
  Observations part = all;
  part.views.clear();
  for (const std::size_t i : views) part.views.push_back(all.views[i]);
  return part;
}

/// Image positions on a grid.
std::vector<Eigen::Vector2d> places(const Observations& o) {
  std::vector<Eigen::Vector2d> list;
  for (int i = 0; i < grid; ++i)
    for (int k = 0; k < grid; ++k)
      list.emplace_back((k + 0.5) / grid * static_cast<double>(o.width) - 0.5,
                        (i + 0.5) / grid * static_cast<double>(o.height) - 0.5);
  return list;
}

/// Fits the pose of a view to its corners with a fixed lens. @returns sum of squares, px^2, over its corners
double resect(const Observations& observations, const View& view, const std::vector<bool>& used,
              const LensSolution& solution, Pose pose) {
  double squares = 0;
  for (int step = 0; step < 15; ++step) {
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> product = Eigen::Matrix<double, 6, 1>::Zero();
    squares = 0;
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      const Corner& corner = view.corners[i];
      const BoardPoint& point = observations.points[corner.point];
      PointDerivatives d;
      if (!used[i] || !derivatives_of(solution, pose, point, warp_basis(observations, point), d)) continue;
      const Eigen::Matrix2d white = whitening(corner, 1);
      const Eigen::Vector2d miss = Eigen::Vector2d(corner.u, corner.v) - d.pixel;
      const Eigen::Matrix<double, 2, 6> row = white * d.pose;
      normal += row.transpose() * row;
      product += row.transpose() * (white * miss);
      squares += miss.squaredNorm();
    }
    const Eigen::Matrix<double, 6, 1> change = normal.ldlt().solve(product);
    const Eigen::Vector3d turn = change.head<3>();
    Eigen::Map<Matrix3> rotation(pose.rotation.data());
    if (turn.norm() > 0)
      rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix() * Matrix3(rotation);
    for (std::size_t i = 0; i < 3; ++i) pose.translation[i] += change[static_cast<Eigen::Index>(3 + i)];
  }
  return squares;
}

/// Difference of two lenses after the best rotation and translation of the camera, px rms over the image positions.
double difference(const Observations& observations, const LensSolution& a, const LensSolution& b, double range) {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  for (const Eigen::Vector2d& pixel : places(observations)) {
    double xy[2];
    if (!unproject(a.lens, pixel.x(), pixel.y(), xy)) continue;
    points.push_back(range * Eigen::Vector3d(xy[0], xy[1], 1).normalized());
    pixels.push_back(pixel);
  }
  double squares = 0;
  for (int step = 0; step < 10; ++step) {
    Eigen::Matrix<double, 6, 6> normal = 1e-12 * Eigen::Matrix<double, 6, 6>::Identity();
    Eigen::Matrix<double, 6, 1> product = Eigen::Matrix<double, 6, 1>::Zero();
    squares = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector2d miss = pixels[i] - image_of(b.lens, points[i]);
      Eigen::Matrix<double, 2, 6> row;
      const Eigen::Matrix<double, 2, 3> place = place_jacobian(b.lens, points[i]);
      for (int k = 0; k < 3; ++k) row.col(k) = place * Eigen::Vector3d::Unit(k).cross(points[i]);
      row.rightCols<3>() = place;
      normal += row.transpose() * row;
      product += row.transpose() * miss;
      squares += miss.squaredNorm();
    }
    const Eigen::Matrix<double, 6, 1> change = normal.ldlt().solve(product);
    const Eigen::Vector3d turn = change.head<3>();
    const Eigen::Matrix3d rotation = turn.norm() > 0
                                         ? Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix()
                                         : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
    for (Eigen::Vector3d& p : points) p = rotation * p + change.tail<3>();
  }
  return std::sqrt(squares / static_cast<double>(std::max<std::size_t>(points.size(), 1)));
}

double mean_variance(const Observations& observations, const LensSolution& solution, double range) {
  const ProjectionUncertainty uncertainty(solution);
  double sum = 0, count = 0;
  for (const Eigen::Vector2d& pixel : places(observations)) {
    const auto j = uncertainty.jacobian(pixel.x(), pixel.y(), range);
    if (!j) continue;
    sum += (*j * solution.covariance * j->transpose()).trace();
    count += 1;
  }
  return sum / std::max(count, 1.0);
}

}  // namespace

double typical_range(const LensSolution& solution) {
  double sum = 0;
  for (const SolvedView& view : solution.views)
    sum += Eigen::Map<const Eigen::Vector3d>(view.pose.translation.data()).norm();
  return sum / static_cast<double>(solution.views.size());
}

std::optional<Eigen::Matrix<double, 2, Eigen::Dynamic>> ProjectionUncertainty::jacobian(double u, double v,
                                                                                        double range) const {
  double xy[2];
  if (!unproject(solution_.lens, u, v, xy)) return std::nullopt;
  const Eigen::Vector3d point = range * Eigen::Vector3d(xy[0], xy[1], 1).normalized();
  const Layout& layout = solution_.layout;
  Eigen::Matrix<double, 2, Eigen::Dynamic> jacobian =
      Eigen::Matrix<double, 2, Eigen::Dynamic>::Zero(2, solution_.covariance.cols());
  for (std::size_t i = 0; i < layout.lens.size(); ++i) {
    const std::size_t parameter = layout.lens[i];
    const double step = parameter <= lens::cy ? 1e-3 : 1e-6;
    LensParameters above = solution_.lens, below = solution_.lens;
    above[parameter] += step;
    below[parameter] -= step;
    jacobian.col(static_cast<Eigen::Index>(i)) = (image_of(above, point) - image_of(below, point)) / (2 * step);
  }
  const Eigen::Matrix<double, 2, 3> place =
      place_jacobian(solution_.lens, point) / static_cast<double>(solution_.views.size());
  for (std::size_t i = 0; i < solution_.views.size(); ++i) {
    const Eigen::Vector3d turned =
        point - Eigen::Map<const Eigen::Vector3d>(solution_.views[i].pose.translation.data());
    const auto at = static_cast<Eigen::Index>(layout.pose(i));
    for (int k = 0; k < 3; ++k) jacobian.col(at + k) = place * Eigen::Vector3d::Unit(k).cross(turned);
    jacobian.middleCols<3>(at + 3) = place;
  }
  return jacobian;
}

double ProjectionUncertainty::at(double u, double v, double range) const {
  const auto j = jacobian(u, v, range);
  if (!j) return std::numeric_limits<double>::quiet_NaN();
  const Eigen::Matrix2d covariance = *j * solution_.covariance * j->transpose();
  return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(covariance).eigenvalues()[1]);
}

TwoSets compare_halves(const Observations& observations, const LensOptions& options, const LensSolution& solution) {
  TwoSets result;
  std::vector<std::size_t> half[2];
  for (std::size_t i = 0; i < solution.views.size(); ++i) half[i % 2].push_back(solution.views[i].view);
  if (half[1].size() < min_views) return result;
  try {
    const Observations first = subset(observations, half[0]), second = subset(observations, half[1]);
    const LensSolution a = solve_lens(first, options), b = solve_lens(second, options);
    const double range = typical_range(solution);
    result.difference = difference(observations, a, b, range);
    result.predicted = std::sqrt(mean_variance(observations, a, range) + mean_variance(observations, b, range));
    result.done = true;
  } catch (const std::runtime_error&) {  // half of the views does not determine a lens
    result.done = false;
  }
  return result;
}

HeldOutViews predict_left_out(const Observations& observations, const LensOptions& options,
                              const LensSolution& solution) {
  HeldOutViews result;
  const std::size_t n = solution.views.size();
  result.folds = std::min(max_folds, n);
  std::vector<double> means(n);  // mean square of each view
  std::vector<double> sums(n);
  std::atomic<bool> determined = result.folds > 0 && n - (n + result.folds - 1) / result.folds >= min_views;
  if (!determined) return result;
  tbb::parallel_for(std::size_t{0}, result.folds, [&](std::size_t fold) {
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < n; ++i)
      if (i % result.folds != fold) kept.push_back(solution.views[i].view);
    try {
      const LensSolution others = solve_lens(subset(observations, kept), options);
      for (std::size_t i = fold; i < n; i += result.folds) {
        const SolvedView& view = solution.views[i];
        sums[i] = resect(observations, observations.views[view.view], view.used, others, view.pose);
      }
    } catch (const std::runtime_error&) {  // the remaining views do not determine a lens
      determined = false;
    }
  });
  if (!determined) return result;
  LensSolution nominal = solution;
  if (observations.expected) nominal.lens = *observations.expected;
  double squares = 0, fitted = 0, by_profile = 0, corners = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const SolvedView& view = solution.views[i];
    const auto used = static_cast<double>(std::ranges::count(view.used, true));
    means[i] = sums[i] / (2 * used);
    squares += sums[i];
    fitted += resect(observations, observations.views[view.view], view.used, solution, view.pose);
    by_profile += resect(observations, observations.views[view.view], view.used, nominal, view.pose);
    corners += used;
  }
  result.done = true;
  result.rms = std::sqrt(squares / (2 * corners));
  result.fitted = std::sqrt(fitted / (2 * corners));
  if (observations.expected) result.nominal = std::sqrt(by_profile / (2 * corners));
  const Interval interval = root_of_mean(means);
  result.low = interval.low;
  result.high = interval.high;
  return result;
}

}  // namespace tofgraph::calibration
