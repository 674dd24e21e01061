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

namespace tofgraph::calibration::pattern {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

inline constexpr Eigen::Index per_view = 4, shapes = shape_terms.size();
inline constexpr double loose_shape = 0.05;  ///< m, a board's shape before anything was seen
inline constexpr ViewPose first_jitter{0, 2e-3, 2e-3, 2e-3};
inline constexpr double min_z = 1e-6, min_tilt = 1e-6;  ///< m, rad: as good as exact
inline constexpr double loose_offset = 1;               ///< m
inline constexpr double no_offset = 1e-7;               ///< m, of the views that the others are counted from

/// What a pixel says: its rows of the problem.
struct Rows {
  Eigen::Index own = 2;                       ///< unknowns of the pixel: map, slope
  std::vector<Eigen::Index> view;             ///< of each row
  std::vector<double> weight, residual, arm;  ///< 1/m^2, m, D - 2 m in m
  std::vector<Eigen::Matrix<double, per_view, 1>> pose;
  std::vector<Eigen::Matrix<double, shapes, 1>> shape;
};

/// Z / D of each pixel: slopes in proportion to it are an offset of whole views, k (Z - ..). NaN: never seen.
inline std::vector<double> inverse_spread(const PatternData& data) {
  std::vector<double> result(data.rows * data.columns, unknown);
  for (std::size_t i = 0; i < result.size(); ++i) {
    double sum = 0, count = 0;
    for (const PatternView& view : data.views) {
      if (!std::isfinite(view.residual[i])) continue;
      sum += view.distance[i] / data.campaign.conditions.conditions[view.condition].board_distance;
      count += 1;
    }
    if (count > 0) result[i] = count / sum;
  }
  return result;
}

using ViewUse = std::vector<char>;  ///< which views are fitted

class Problem {
 public:
  Problem(const PatternData& data, ViewUse use, bool slope)
      : data_(data),
        use_(std::move(use)),
        slope_(slope),
        size_(per_view * static_cast<Eigen::Index>(use_.size()) + shapes),
        fixed_offset_(use_.size()),
        inverse_spread_(inverse_spread(data)) {
    // An offset of all views is the mean of the map, and one that grows with the distance that of the slopes: they are
    // counted from the first view and from the one that stood farthest from it.
    const auto distance = [&](std::size_t v) {
      return data.campaign.conditions.conditions[data.views[v].condition].board_distance;
    };
    const auto first = static_cast<std::size_t>(std::ranges::find(use_, 1) - use_.begin());
    std::size_t other = first;
    for (std::size_t v = first; v < use_.size(); ++v) {
      if (use_[v] != 0 && std::abs(distance(v) - distance(first)) > std::abs(distance(other) - distance(first)))
        other = v;
    }
    fixed_offset_[first] = 1;
    if (slope) fixed_offset_[other] = 1;
  }

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
  void solve(PatternFit& fit) {
    ViewPose jitter = first_jitter;
    constexpr int rounds = 20;
    for (int round = 0; round < rounds; ++round) {
      Matrix system = gram_;
      for (Eigen::Index k = 0; k < size_; ++k) system(k, k) += 1 / std::pow(prior(k, jitter), 2);
      covariance_ = system.llt().solve(Matrix::Identity(size_, size_));
      theta_ = covariance_ * moment_;
      jitter = estimated(jitter);
    }
    fit.jitter = jitter;
    fit.poses.assign(use_.size(), {});
    for (std::size_t v = 0; v < use_.size(); ++v) {
      const Eigen::Index at = per_view * static_cast<Eigen::Index>(v);
      fit.poses[v] = {theta_[at], theta_[at + 1], theta_[at + 2], theta_[at + 3]};
    }
    fit.shape.assign(theta_.data() + size_ - shapes, theta_.data() + size_);
    fit.shape_sd.clear();
    for (Eigen::Index k = size_ - shapes; k < size_; ++k) fit.shape_sd.push_back(std::sqrt(covariance_(k, k)));
  }

  /// The pixels' own unknowns, and what is left over the noise.
  void back_substitute(PatternFit& fit) const {
    const std::size_t pixels = data_.rows * data_.columns;
    for (std::vector<double>* values : {&fit.map, &fit.slope}) values->assign(pixels, 0);
    for (std::vector<double>* values : {&fit.map_sd, &fit.slope_sd}) values->assign(pixels, unknown);
    double square = 0, freedom = 0, noise = 0, count = 0;
    const Gauge gauge = mean_gain();
    for (std::size_t i = 0; i < pixels; ++i) {
      const Rows rows = rows_of(i);
      if (rows.view.size() < static_cast<std::size_t>(rows.own + 1)) continue;
      const Own own = own_of(rows);
      const Matrix inverse = own.local.inverse();
      const Vector x = inverse * (own.moment - own.cross * theta_);
      const Matrix gain = without_means(inverse * own.cross, gauge, i);
      const Matrix covariance = inverse + gain * covariance_ * gain.transpose();
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
    Matrix gram;
    Vector moment;
  };
  struct Own {
    Matrix local, cross;
    Vector moment;
  };

  static Eigen::Matrix<double, per_view, 1> pose_of(const PatternView& view, std::size_t i) {
    const double z = view.along_z[i], x = view.place[i][0], y = view.place[i][1];
    return {1, z, z * y, -z * x};  // R_x turns y towards z, R_y turns x away from it
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
    Own own{Matrix::Zero(rows.own, rows.own), Matrix::Zero(rows.own, size_), Vector::Zero(rows.own)};
    for (std::size_t r = 0; r < rows.view.size(); ++r) {
      Vector mine(rows.own);
      mine[0] = 1;
      if (rows.own > 1) mine[1] = rows.arm[r];
      const Vector weighted = rows.weight[r] * mine;
      own.local += weighted * mine.transpose();
      own.moment += weighted * rows.residual[r];
      own.cross.middleCols(per_view * rows.view[r], per_view) += weighted * rows.pose[r].transpose();
      own.cross.rightCols(shapes) += weighted * rows.shape[r].transpose();
    }
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
      const Eigen::Matrix<double, per_view, shapes> mixed = w * rows.pose[r] * rows.shape[r].transpose();
      sums.gram.block<per_view, shapes>(at, size_ - shapes) += mixed;
      sums.gram.block<shapes, per_view>(size_ - shapes, at) += mixed.transpose();
      sums.gram.bottomRightCorner<shapes, shapes>() += w * rows.shape[r] * rows.shape[r].transpose();
      sums.moment.segment<per_view>(at) += w * y * rows.pose[r];
      sums.moment.tail<shapes>() += w * y * rows.shape[r];
    }
    const Matrix half = own.local.llt().matrixL().solve(own.cross);
    sums.gram.noalias() -= half.transpose() * half;
    sums.moment -= own.cross.transpose() * own.local.llt().solve(own.moment);
  }

  /// How the means of the pixels' unknowns go with the few common ones.
  struct Gauge {
    Matrix gain;
    double spread = 0;  ///< mean of Z / D
  };
  Gauge mean_gain() const {
    Gauge gauge{Matrix::Zero(slope_ ? 2 : 1, size_)};
    double count = 0;
    for (std::size_t i = 0; i < data_.rows * data_.columns; ++i) {
      const Rows rows = rows_of(i);
      if (rows.view.size() < static_cast<std::size_t>(rows.own + 1)) continue;
      const Own own = own_of(rows);
      gauge.gain += own.local.inverse() * own.cross;
      gauge.spread += inverse_spread_[i];
      count += 1;
    }
    gauge.gain /= std::max(count, 1.0);
    gauge.spread /= std::max(count, 1.0);
    return gauge;
  }
  /// Of the map and the slopes without their means, which nobody knows; see take_means_out.
  Matrix without_means(Matrix gain, const Gauge& gauge, std::size_t i) const {
    gain.row(0) -= gauge.gain.row(0);
    if (!slope_) return gain;
    const Matrix growth = gauge.gain.row(1) / gauge.spread;
    gain.row(0) -= slope_origin * (inverse_spread_[i] - gauge.spread) * growth;
    gain.row(1) -= inverse_spread_[i] * growth;
    return gain;
  }

  double prior(Eigen::Index k, const ViewPose& jitter) const {
    if (k >= size_ - shapes) return loose_shape;
    const bool fixed = fixed_offset_[static_cast<std::size_t>(k / per_view)] != 0;
    const double sd[] = {fixed ? no_offset : loose_offset, jitter.z, jitter.tilt_x, jitter.tilt_y};
    return sd[k % per_view];
  }

  /// Mean square of what was found and of what is not known of it.
  ViewPose estimated(const ViewPose& before) const {
    double z = 0, tilt = 0, count = 0;
    for (std::size_t v = 0; v < use_.size(); ++v) {
      if (use_[v] == 0) continue;
      const Eigen::Index at = per_view * static_cast<Eigen::Index>(v);
      const auto square = [&](Eigen::Index k) { return theta_[k] * theta_[k] + covariance_(k, k); };
      z += square(at + 1);
      tilt += square(at + 2) + square(at + 3);
      count += 1;
    }
    if (count == 0) return before;
    const double sd = std::max(std::sqrt(tilt / (2 * count)), min_tilt);
    return {0, std::max(std::sqrt(z / count), min_z), sd, sd};
  }

  double told(const Rows& rows, std::size_t r) const {
    return rows.pose[r].dot(theta_.segment<per_view>(per_view * rows.view[r])) +
           rows.shape[r].dot(theta_.tail<shapes>());
  }

  const PatternData& data_;
  ViewUse use_;
  bool slope_;
  Eigen::Index size_;
  ViewUse fixed_offset_;
  std::vector<double> inverse_spread_;
  Matrix gram_, covariance_;
  Vector moment_, theta_;
};

}  // namespace tofgraph::calibration::pattern
