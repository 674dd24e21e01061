// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/bundle_problem.hpp"

#include <glog/logging.h>
#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tofgraph::calibration {
namespace {

// Standard deviations of priors: wide, they only bound parameters that the data do not determine.
constexpr double warp_prior = 5e-3;         ///< m
constexpr double range_offset_prior = 1;    ///< m
constexpr double without_distances = 1e-3;  ///< m: arbitrary, without influence

/// Silences Ceres' messages on single steps; the result is reported separately.
void silence_ceres() {
  static const bool once = [] {
    FLAGS_minloglevel = google::GLOG_FATAL;
    return true;
  }();
  (void)once;
}

std::vector<int> held(const std::vector<std::size_t>& free, std::size_t count) {
  std::vector<int> constant;
  for (std::size_t i = 0; i < count; ++i)
    if (std::ranges::find(free, i) == free.end()) constant.push_back(static_cast<int>(i));
  return constant;
}

}  // namespace

std::array<double, 3> warp_basis(const Observations& observations, const BoardPoint& point) {
  double x = 1e-9, y = 1e-9;
  for (const BoardPoint& p : observations.points) {
    x = std::max(x, std::abs(p.x));
    y = std::max(y, std::abs(p.y));
  }
  const double a = point.x / x, b = point.y / y;
  if (observations.quarter_turns) return {a * a + b * b, 0, 0};
  return {a * a, b * b, a * b};
}

BundleProblem::BundleProblem(const Observations& observations, const LensOptions& options)
    : observations_(observations), options_(options) {
  silence_ceres();
  for (const BoardPoint& p : observations.points) {
    points_.push_back({p.x, p.y, warp_basis(observations, p)});
    half_extent_[0] = std::max(half_extent_[0], std::abs(p.x));
    half_extent_[1] = std::max(half_extent_[1], std::abs(p.y));
  }
  using enum lens::Parameter;
  free_lens_ = {fx, fy, cx, cy, k1, k2};
  if (observations.fisheye) {
    free_lens_.insert(free_lens_.end(), {k3, k4});
  } else {
    free_lens_.insert(free_lens_.end(), {p1, p2});
    if (options.k3) free_lens_.push_back(k3);
    if (options.rational) free_lens_.insert(free_lens_.end(), {k4, k5, k6});
  }
  if (options.skew) free_lens_.push_back(skew);
  for (std::size_t i = 0; options.warp && i < (observations.quarter_turns ? 1U : 3U); ++i) free_warp_.push_back(i);
  lens = initial_lens(observations);
  for (const int fixed : held(free_lens_, lens::count)) lens[static_cast<std::size_t>(fixed)] = 0;
  lens[fisheye] = observations.fisheye ? 1 : 0;
  start_poses();
}

void BundleProblem::start_poses() {
  for (std::size_t i = 0; i < observations_.views.size(); ++i) {
    SolvedView view{.view = i, .used = std::vector<bool>(observations_.views[i].corners.size(), true)};
    if (!initial_pose(observations_, observations_.views[i], lens, view.pose))
      throw std::runtime_error("the pose of the board in '" + observations_.views[i].id + "' is not determined");
    const Pose& pose = view.pose;
    poses_.push_back({0, 0, 0, pose.translation[0], pose.translation[1], pose.translation[2], 0});
    views.push_back(std::move(view));
  }
}

Layout BundleProblem::layout(bool with_distances) const {
  return {free_lens_, free_warp_.size(), with_distances ? std::size_t{2} : std::size_t{0}};
}

void BundleProblem::leave_out(std::size_t solved_view) {
  views.erase(views.begin() + static_cast<std::ptrdiff_t>(solved_view));
  poses_.erase(poses_.begin() + static_cast<std::ptrdiff_t>(solved_view));
}

cost::CornerResidual BundleProblem::corner_residual(std::size_t index, const Corner& corner, double scale) const {
  const auto [uu, uv, vv] = corner.covariance;
  const double l00 = std::sqrt(uu), l10 = uv / l00, l11 = std::sqrt(vv - l10 * l10);
  return {.u = corner.u,
          .v = corner.v,
          .white = {1 / (l00 * scale), -l10 / (l00 * l11 * scale), 1 / (l11 * scale)},
          .point = points_[corner.point],
          .radius = observations_.circle_radius,
          .rotation = views[index].pose.rotation.data()};
}

cost::DistanceResidual BundleProblem::distance_residual(std::size_t index, const BoardDistance& d, double scale) const {
  return {.u = d.u,
          .v = d.v,
          .distance = d.distance,
          .sd = d.sd * scale,
          .half_extent = half_extent_,
          .isotropic = observations_.quarter_turns,
          .light = &*observations_.light,
          .rotation = views[index].pose.rotation.data()};
}

void BundleProblem::add_view(ceres::Problem& problem, std::size_t index, bool robust, bool with_distances,
                             const Scatter& scatter) {
  const View& seen = observations_.views[views[index].view];
  double* const pose = poses_[index].data();
  for (std::size_t i = 0; i < seen.corners.size(); ++i) {
    if (!views[index].used[i]) continue;
    const cost::CornerResidual residual = corner_residual(index, seen.corners[i], scatter.corners);
    ceres::CostFunction* cost = nullptr;
    if (residual.radius > 0)
      cost = new ceres::AutoDiffCostFunction<cost::CornerResidual, 2, lens::count, 3, 7>(
          new cost::CornerResidual(residual));
    else
      cost = new cost::CornerCost(residual);
    problem.AddResidualBlock(cost, robust ? new ceres::HuberLoss(3) : nullptr, lens.data(), warp.data(), pose);
  }
  for (std::size_t i = 0; with_distances && i < seen.distances.size(); ++i) {
    auto* cost = new cost::DistanceCost(distance_residual(index, seen.distances[i], scatter.distances));
    problem.AddResidualBlock(cost, new ceres::HuberLoss(3), lens.data(), warp.data(), range.data(), pose);
  }
  const double shift = with_distances && !seen.distances.empty() ? scatter.range_shift : without_distances;
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<cost::Prior, 1, 7>(new cost::Prior{shift, 6}), nullptr,
                           pose);
}

void BundleProblem::build(ceres::Problem& problem, bool robust, bool with_distances, const Scatter& scatter) {
  problem.AddParameterBlock(lens.data(), lens::count);
  problem.SetManifold(lens.data(), new ceres::SubsetManifold(lens::count, held(free_lens_, lens::count)));
  problem.AddParameterBlock(warp.data(), 3);
  if (free_warp_.empty())
    problem.SetParameterBlockConstant(warp.data());
  else if (free_warp_.size() < 3)
    problem.SetManifold(warp.data(), new ceres::SubsetManifold(3, held(free_warp_, 3)));
  for (std::size_t i = 0; i < views.size(); ++i) add_view(problem, i, robust, with_distances, scatter);
  for (const std::size_t i : free_warp_)
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<cost::Prior, 1, 3>(new cost::Prior{warp_prior, static_cast<int>(i)}), nullptr,
        warp.data());
  if (!with_distances) return;
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<cost::Prior, 1, 2>(new cost::Prior{range_offset_prior, 0}),
                           nullptr, range.data());
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<cost::Prior, 1, 2>(new cost::Prior{range_scale_prior, 1}),
                           nullptr, range.data());
}

bool BundleProblem::solve(bool robust, bool with_distances, const Scatter& scatter) {
  ceres::Problem problem;
  build(problem, robust, with_distances, scatter);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  auto* ordering = new ceres::ParameterBlockOrdering;
  for (auto& pose : poses_) ordering->AddElementToGroup(pose.data(), 0);
  ordering->AddElementToGroup(lens.data(), 1);
  ordering->AddElementToGroup(warp.data(), 1);
  if (with_distances) ordering->AddElementToGroup(range.data(), 1);
  options.linear_solver_ordering.reset(ordering);
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-10;
  options.parameter_tolerance = 1e-11;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  fold();
  return summary.termination_type == ceres::CONVERGENCE;
}

/// Moves the small rotations into the fixed ones: the covariance then refers to rotations about the camera's axes.
void BundleProblem::fold() {
  for (std::size_t i = 0; i < views.size(); ++i) {
    using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    Eigen::Map<Matrix> rotation(views[i].pose.rotation.data());
    const Eigen::Vector3d small(poses_[i][0], poses_[i][1], poses_[i][2]);
    if (small.norm() > 0)
      rotation = Eigen::AngleAxisd(small.norm(), small.normalized()).toRotationMatrix() * Matrix(rotation);
    std::fill_n(poses_[i].begin(), 3, 0.0);
    std::copy_n(poses_[i].begin() + 3, 3, views[i].pose.translation.begin());
    views[i].range_shift = poses_[i][6];
  }
}

void BundleProblem::update_residuals(bool with_distances) {
  for (std::size_t i = 0; i < views.size(); ++i) {
    SolvedView& view = views[i];
    const View& seen = observations_.views[view.view];
    view.residuals.clear();
    view.distance_residuals.clear();
    double squares = 0, count = 0;
    for (std::size_t k = 0; k < seen.corners.size(); ++k) {
      double pixel[2] = {1e6, 1e6};  // behind the camera: far outside
      corner_residual(i, seen.corners[k], 1).predict<double>(lens.data(), warp.data(), poses_[i].data(), pixel);
      view.residuals.push_back({seen.corners[k].u - pixel[0], seen.corners[k].v - pixel[1]});
      if (!view.used[k]) continue;
      squares += std::pow(view.residuals.back()[0], 2) + std::pow(view.residuals.back()[1], 2);
      count += 2;
    }
    view.rms = std::sqrt(squares / std::max(count, 1.0));
    for (std::size_t k = 0; with_distances && k < seen.distances.size(); ++k) {
      double predicted = seen.distances[k].distance;
      distance_residual(i, seen.distances[k], 1)
          .predict<double>(lens.data(), warp.data(), range.data(), poses_[i].data(), &predicted);
      view.distance_residuals.push_back(seen.distances[k].distance - predicted);
    }
  }
}

Eigen::MatrixXd BundleProblem::covariance(bool with_distances, const Scatter& scatter) {
  ceres::Problem problem;
  build(problem, false, with_distances, scatter);
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks.push_back(lens.data());
  if (!free_warp_.empty()) options.parameter_blocks.push_back(warp.data());
  if (with_distances) options.parameter_blocks.push_back(range.data());
  for (auto& pose : poses_) options.parameter_blocks.push_back(pose.data());
  ceres::CRSMatrix jacobian;
  problem.Evaluate(options, nullptr, nullptr, nullptr, &jacobian);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(jacobian.num_cols, jacobian.num_cols);
  for (int row = 0; row < jacobian.num_rows; ++row) {
    const auto begin = static_cast<std::size_t>(jacobian.rows[static_cast<std::size_t>(row)]);
    const auto end = static_cast<std::size_t>(jacobian.rows[static_cast<std::size_t>(row) + 1]);
    for (std::size_t a = begin; a < end; ++a)
      for (std::size_t b = begin; b < end; ++b)
        normal(jacobian.cols[a], jacobian.cols[b]) += jacobian.values[a] * jacobian.values[b];
  }
  // Parameters differ by orders of magnitude: scaled to a unit diagonal before the factorisation.
  const Eigen::VectorXd scale = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  normal = scale.asDiagonal() * normal * scale.asDiagonal();
  const Eigen::LLT<Eigen::MatrixXd> factor(normal);
  if (factor.info() != Eigen::Success)
    throw std::runtime_error(
        "the lens is not determined by these views: tilt the board by 20 to 40 deg about both axes in most of them");
  return scale.asDiagonal() * factor.solve(Eigen::MatrixXd::Identity(normal.rows(), normal.cols())) *
         scale.asDiagonal();
}

}  // namespace tofgraph::calibration
