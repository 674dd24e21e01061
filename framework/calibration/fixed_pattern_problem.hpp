// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The equations of a fixed pattern: residual = map + slope (D - 2 m) of each pixel, plus offset, place and tilt
/// of each view, plus the board's shape. The pixels' own unknowns are eliminated one pixel at a time (Schur
/// complement), the few that are left are solved for exactly; how much boards are out of place is estimated with them
/// (expectation maximisation).
#pragma once

#include "calibration/fixed_pattern.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>
#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace tofgraph::calibration::pattern {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

inline constexpr Eigen::Index per_view = 5, shapes = shape_terms.size();
inline constexpr double loose_shape = 5e-3;  ///< m, of a board before anything was seen
inline constexpr ViewPose first_jitter{0, 30e-3, 5e-3, 5e-3, 50e-3};
inline constexpr double min_z = 1e-6, min_tilt = 1e-6, min_bend = 1e-6;  ///< m, rad, 1/m: as good as none
inline constexpr double loose_offset = 1;                                ///< m
inline constexpr double no_offset = 1e-7;  ///< m, of the first view: all others and the map are counted from it

/// What a pixel says: its rows of the problem.
struct Rows {
  Eigen::Index own = 2;                       ///< unknowns of the pixel: map, slope
  std::vector<Eigen::Index> view;             ///< of each row
  std::vector<double> weight, residual, arm;  ///< 1/m^2, m, D - 2 m in m
  std::vector<Eigen::Matrix<double, per_view, 1>> pose;
  std::vector<Eigen::Matrix<double, shapes, 1>> shape;
};

using ViewUse = std::vector<char>;  ///< which views are fitted

class Problem {
 public:
  /// @param slope_sd how much slopes differ from pixel to pixel, beforehand; 0: there are none
  Problem(const PatternData& data, ViewUse use, double slope_sd)
      : data_(data),
        use_(std::move(use)),
        slope_sd_(slope_sd),
        slope_(slope_sd > 0),
        size_(per_view * static_cast<Eigen::Index>(use_.size()) + shapes),
        first_(std::ranges::find(use_, 1) - use_.begin()) {}

  void assemble() {
    const std::size_t pixels = data_.rows * data_.columns;
    const Sums sums = tbb::parallel_deterministic_reduce(
        tbb::blocked_range<std::size_t>(0, pixels, 512), Sums(size_),
        [&](const tbb::blocked_range<std::size_t>& range, Sums sums) {
          for (std::size_t i = range.begin(); i < range.end(); ++i) add(i, sums);
          return sums;
        },
        [](Sums a, const Sums& b) {
          a.gram += b.gram;
          a.moment += b.moment;
          return a;
        });
    gram_ = sums.gram;
    moment_ = sums.moment;
  }

  /// Solves, and estimates the jitter of the poses.
  /// @throws std::runtime_error when the data tell nothing
  void solve(PatternFit& fit, ViewPose jitter = first_jitter) {
    constexpr int rounds = 200;
    constexpr double settled = 2e-3;  // relative
    for (int round = 0; round < rounds; ++round) {
      Matrix system = gram_;
      for (Eigen::Index k = 0; k < size_; ++k) system(k, k) += 1 / std::pow(prior(k, jitter), 2);
      const Eigen::LLT<Matrix> factor(system);
      if (factor.info() != Eigen::Success || !moment_.allFinite())
        throw std::runtime_error(
            "the boards do not determine a pattern: too few pixels were seen, or none of them twice");
      covariance_ = factor.solve(Matrix::Identity(size_, size_));
      theta_ = covariance_ * moment_;
      const ViewPose before = std::exchange(jitter, estimated(jitter));
      const auto same = [](double a, double b) { return std::abs(a - b) <= settled * a; };
      if (same(before.z, jitter.z) && same(before.tilt_x, jitter.tilt_x) && same(before.bend, jitter.bend)) break;
    }
    fit.jitter = jitter;
    fit.poses.assign(use_.size(), {});
    for (std::size_t v = 0; v < use_.size(); ++v) {
      const Eigen::Index at = per_view * static_cast<Eigen::Index>(v);
      fit.poses[v] = {theta_[at], theta_[at + 1], theta_[at + 2], theta_[at + 3], theta_[at + 4]};
    }
    fit.shape.assign(theta_.data() + size_ - shapes, theta_.data() + size_);
    fit.shape_sd.clear();
    for (Eigen::Index k = size_ - shapes; k < size_; ++k) fit.shape_sd.push_back(std::sqrt(covariance_(k, k)));
  }

  /// The pixels' own unknowns, and what is left over the noise.
  /// @param all_of_sd whether standard deviations contain what the few common unknowns add, which takes most of the
  /// time
  void back_substitute(PatternFit& fit, bool all_of_sd = true) const {
    const std::size_t pixels = data_.rows * data_.columns;
    for (std::vector<double>* values : {&fit.map, &fit.slope}) values->assign(pixels, 0);
    for (std::vector<double>* values : {&fit.map_sd, &fit.slope_sd}) values->assign(pixels, unknown);
    double square = 0, freedom = 0, noise = 0, count = 0;
    const Eigen::RowVectorXd mean = all_of_sd ? mean_gain() : Eigen::RowVectorXd();
    for (std::size_t i = 0; i < pixels; ++i) {
      const Rows rows = rows_of(i);
      if (rows.view.size() < static_cast<std::size_t>(rows.own + 1)) continue;
      const Own own = own_of(rows);
      const OwnMatrix inverse = own.local.inverse();
      const OwnVector x = inverse * (own.moment - own.cross * theta_);
      OwnMatrix covariance = inverse;
      if (all_of_sd) {
        OwnRows gain = inverse * own.cross;
        gain.row(0) -= mean;  // of the map without its mean, which nobody knows
        covariance += gain * covariance_ * gain.transpose();
      }
      fit.map[i] = x[0];
      fit.map_sd[i] = std::sqrt(covariance(0, 0));
      if (slope_) {
        fit.slope[i] = x[1];
        fit.slope_sd[i] = std::sqrt(covariance(1, 1));
      }
      for (std::size_t r = 0; r < rows.view.size(); ++r) {
        const double left = rows.residual[r] - x[0] - (slope_ ? x[1] * rows.arm[r] : 0) - told(rows, r);
        square += rows.weight[r] * left * left;
        noise += 1 / rows.weight[r];
        count += 1;
      }
      freedom += static_cast<double>(rows.view.size()) - static_cast<double>(rows.own);
    }
    fit.misfit = std::sqrt(square / std::max(freedom - static_cast<double>(size_), 1.0));
    fit.noise = std::sqrt(noise / std::max(count, 1.0));
  }

  /// Root mean square of a view that was not fitted, minus its own offset, place and tilt, and what noise leaves.
  std::array<double, 3> predict(std::size_t v, const PatternFit& fit) const {
    Matrix a = Matrix::Zero(per_view, per_view);
    Vector before = Vector::Zero(per_view), after = before;
    const PatternView& view = data_.views[v];
    std::vector<double> raw, predicted;
    std::vector<Eigen::Matrix<double, per_view, 1>> poses;
    double noise = 0;
    for (std::size_t i = 0; i < view.residual.size(); ++i) {
      if (!std::isfinite(view.residual[i]) || !std::isfinite(fit.map_sd[i])) continue;
      poses.push_back(pose_of(view, i));
      raw.push_back(view.residual[i]);
      const double x = view.place[i][0] / data_.extent, y = view.place[i][1] / data_.extent;
      predicted.push_back(raw.back() - fit.map[i] - fit.slope[i] * (view.distance[i] - slope_origin) -
                          view.along_z[i] * shape_at(fit.shape, x, y));
      a += poses.back() * poses.back().transpose();
      before += poses.back() * raw.back();
      after += poses.back() * predicted.back();
      noise += 1 / double{view.weight[i]};
    }
    // Places as far out as the others' are, offsets any.
    const double scale = noise / static_cast<double>(std::max<std::size_t>(raw.size(), 1));
    for (Eigen::Index k = 1; k < per_view; ++k) a(k, k) += scale / std::pow(prior(k, fit.jitter), 2);
    before = a.ldlt().solve(before);
    after = a.ldlt().solve(after);
    double b = 0, c = 0;
    for (std::size_t k = 0; k < raw.size(); ++k) {
      b += std::pow(raw[k] - poses[k].dot(before), 2);
      c += std::pow(predicted[k] - poses[k].dot(after), 2);
    }
    const auto n = static_cast<double>(std::max<std::size_t>(raw.size(), 1));
    return {std::sqrt(b / n), std::sqrt(c / n), std::sqrt(noise / n)};
  }

 private:
  struct Sums {
    explicit Sums(Eigen::Index size) : gram(Matrix::Zero(size, size)), moment(Vector::Zero(size)) {}
    Matrix gram;  ///< its lower half
    Vector moment;
  };
  // Of one or two unknowns: what is small needs no memory from the heap, for each pixel anew.
  using OwnMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 2, 2>;
  using OwnRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, 2>;
  using OwnVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 2, 1>;
  struct Own {
    OwnMatrix local;
    OwnRows cross;
    OwnVector moment;
  };

  static Eigen::Matrix<double, per_view, 1> pose_of(const PatternView& view, std::size_t i) {
    const double z = view.along_z[i], x = view.place[i][0], y = view.place[i][1];
    const double beyond = view.distance[i] - view.board_distance;
    return {1, z, z * y, -z * x, beyond * beyond};  // R_x turns y towards z, R_y turns x away from it
  }

  Rows rows_of(std::size_t i) const {
    Rows rows;
    rows.own = slope_ ? 2 : 1;
    for (std::size_t v = 0; v < data_.views.size(); ++v) {
      const PatternView& view = data_.views[v];
      if (use_[v] == 0 || !std::isfinite(view.residual[i])) continue;
      rows.view.push_back(static_cast<Eigen::Index>(v));
      rows.weight.push_back(view.weight[i]);
      rows.residual.push_back(view.residual[i]);
      rows.arm.push_back(view.distance[i] - slope_origin);
      rows.pose.push_back(pose_of(view, i));
      const auto terms = shape_terms_at(view.place[i][0] / data_.extent, view.place[i][1] / data_.extent);
      rows.shape.emplace_back(view.along_z[i] * Eigen::Map<const Eigen::Matrix<double, shapes, 1>>(terms.data()));
    }
    return rows;
  }

  Own own_of(const Rows& rows) const {
    Own own{OwnMatrix::Zero(rows.own, rows.own), OwnRows::Zero(rows.own, size_), OwnVector::Zero(rows.own)};
    for (std::size_t r = 0; r < rows.view.size(); ++r) {
      OwnVector mine(rows.own);
      mine[0] = 1;
      if (rows.own > 1) mine[1] = rows.arm[r];
      const OwnVector weighted = rows.weight[r] * mine;
      own.local += weighted * mine.transpose();
      own.moment += weighted * rows.residual[r];
      own.cross.middleCols<per_view>(per_view * rows.view[r]) += weighted * rows.pose[r].transpose();
      own.cross.rightCols<shapes>() += weighted * rows.shape[r].transpose();
    }
    if (rows.own > 1) own.local(1, 1) += 1 / (slope_sd_ * slope_sd_);
    return own;
  }

  void add(std::size_t i, Sums& sums) const {
    const Rows rows = rows_of(i);
    if (rows.view.size() < static_cast<std::size_t>(rows.own + 1)) return;
    const Own own = own_of(rows);
    for (std::size_t r = 0; r < rows.view.size(); ++r) {
      const Eigen::Index at = per_view * rows.view[r];
      const double w = rows.weight[r], y = rows.residual[r];
      sums.gram.block<per_view, per_view>(at, at) += w * rows.pose[r] * rows.pose[r].transpose();
      sums.gram.block<shapes, per_view>(size_ - shapes, at) += w * rows.shape[r] * rows.pose[r].transpose();
      sums.gram.bottomRightCorner<shapes, shapes>() += w * rows.shape[r] * rows.shape[r].transpose();
      sums.moment.segment<per_view>(at) += w * y * rows.pose[r];
      sums.moment.tail<shapes>() += w * y * rows.shape[r];
    }
    const Eigen::LLT<OwnMatrix> factor(own.local);
    const OwnRows half = factor.matrixL().solve(own.cross);
    for (Eigen::Index k = 0; k < rows.own; ++k)
      sums.gram.selfadjointView<Eigen::Lower>().rankUpdate(half.row(k).transpose(), -1);
    sums.moment -= own.cross.transpose() * factor.solve(own.moment);
  }

  /// How the mean of the map goes with the few common ones.
  Eigen::RowVectorXd mean_gain() const {
    Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(size_);
    double count = 0;
    for (std::size_t i = 0; i < data_.rows * data_.columns; ++i) {
      const Rows rows = rows_of(i);
      if (rows.view.size() < static_cast<std::size_t>(rows.own + 1)) continue;
      const Own own = own_of(rows);
      sum += own.local.inverse().row(0) * own.cross;
      count += 1;
    }
    return sum / std::max(count, 1.0);
  }

  double prior(Eigen::Index k, const ViewPose& jitter) const {
    if (k >= size_ - shapes) return loose_shape;
    const double sd[] = {k == per_view * first_ ? no_offset : loose_offset, jitter.z, jitter.tilt_x, jitter.tilt_y,
                         jitter.bend};
    return sd[k % per_view];
  }

  /// Mean square of what was found and of what is not known of it.
  ViewPose estimated(const ViewPose& before) const {
    double z = 0, tilt = 0, bend = 0, count = 0;
    for (std::size_t v = 0; v < use_.size(); ++v) {
      if (use_[v] == 0) continue;
      const Eigen::Index at = per_view * static_cast<Eigen::Index>(v);
      const auto square = [&](Eigen::Index k) { return theta_[k] * theta_[k] + covariance_(k, k); };
      z += square(at + 1);
      tilt += square(at + 2) + square(at + 3);
      bend += square(at + 4);
      count += 1;
    }
    if (count == 0) return before;
    const double sd = std::max(std::sqrt(tilt / (2 * count)), min_tilt);
    return {0, std::max(std::sqrt(z / count), min_z), sd, sd, std::max(std::sqrt(bend / count), min_bend)};
  }

  double told(const Rows& rows, std::size_t r) const {
    return rows.pose[r].dot(theta_.segment<per_view>(per_view * rows.view[r])) +
           rows.shape[r].dot(theta_.tail<shapes>());
  }

  const PatternData& data_;
  ViewUse use_;
  double slope_sd_;
  bool slope_;
  Eigen::Index size_;
  Eigen::Index first_;
  Matrix gram_, covariance_;
  Vector moment_, theta_;
};

}  // namespace tofgraph::calibration::pattern
