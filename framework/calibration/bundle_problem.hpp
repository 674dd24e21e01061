// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Parameters of the bundle adjustment and the problem that Ceres solves. Part of bundle.cpp.
#pragma once

#include "calibration/bundle_cost.hpp"

namespace tofgraph::calibration {

/// Scatter used for weighting the residuals; estimated from them.
struct Scatter {
  double corners = 1;         ///< factor of the stated standard deviations
  double distances = 1;       ///< factor of the stated standard deviations
  double range_shift = 3e-3;  ///< m, common to the distances of a view
};

/// State of the fit.
class BundleProblem {
 public:
  /// Initial lens and poses by OpenCV. @throws std::runtime_error if there are none
  BundleProblem(const Observations& observations, const LensOptions& options);

  /// Least squares from the current state. @param robust large residuals are down-weighted
  /// @returns true if it converged
  bool solve(bool robust, bool with_distances, const Scatter& scatter);
  /// Computes residuals and their sums at the current state.
  void update_residuals(bool with_distances);
  /// Inverse of the normal matrix at the current state, in the order of layout().
  Eigen::MatrixXd covariance(bool with_distances, const Scatter& scatter);
  Layout layout(bool with_distances) const;
  void leave_out(std::size_t solved_view);

  LensParameters lens{};
  std::array<double, 3> warp{};
  std::array<double, 2> range{};
  std::vector<SolvedView> views;

 private:
  void start_poses();
  void build(ceres::Problem& problem, bool robust, bool with_distances, const Scatter& scatter);
  void add_view(ceres::Problem& problem, std::size_t index, bool robust, bool with_distances, const Scatter& scatter);
  cost::CornerResidual corner_residual(std::size_t index, const Corner& corner, double scale) const;
  cost::DistanceResidual distance_residual(std::size_t index, const BoardDistance& distance, double scale) const;
  void fold();

  const Observations& observations_;
  LensOptions options_;
  std::array<double, 2> half_extent_{};
  std::vector<cost::BentPoint> points_;
  std::vector<cost::PoseParameters> poses_;
  std::vector<std::size_t> free_lens_, free_warp_;
};

/// Initial lens and poses of all views. @throws std::runtime_error
LensParameters initial_lens(const Observations& observations);
/// Initial pose by homography and refinement. @returns false if there is none
bool initial_pose(const Observations& observations, const View& view, const LensParameters& lens, Pose& pose);

}  // namespace tofgraph::calibration
