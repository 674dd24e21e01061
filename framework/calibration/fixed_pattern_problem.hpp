// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Equations of a fixed pattern: residual = map + slope (D - 2 m) of each pixel, plus offset, position and tilt
/// of each view, plus the board's shape and a distance-dependent error. The unknowns of the pixels are eliminated one
/// pixel at a time (Schur complement), the few remaining unknowns are solved for exactly; the scatter of the boards'
/// positions is estimated with them by maximising the marginal likelihood (MacKay, Neural Computation 4, 1992), within
/// the bounds of fixed_pattern_priors.hpp.
#pragma once

#include "calibration/fixed_pattern_rows.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>
#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace tofgraph::calibration::pattern {

class Problem {
 public:
  /// @param slope_sd prior standard deviation of the slopes over the pixels; 0: no slopes
  Problem(const PatternData& data, ViewUse use, double slope_sd)
      : data_(data),
        use_(std::move(use)),
        slope_sd_(slope_sd),
        slope_(slope_sd > 0),
        size_(per_view * static_cast<Eigen::Index>(use_.size()) + commons) {}

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

  /// Solves the equations and estimates the jitter of the poses until the gradient of the marginal likelihood vanishes.
  /// @throws std::runtime_error if the data determine no pattern
  void solve(PatternFit& fit, ViewPose jitter) {
    constexpr int rounds = 300;
    constexpr double settled = 4e-3;  // relative to the number of unknowns that share a standard deviation
    for (int round = 0; round < rounds; ++round) {
      solve_with(jitter);
      const Improved next = improved(jitter);
      fit.gradient = next.gradient;
      if (next.gradient < settled) break;
      jitter = next.jitter;
      wave_scale_ = next.wave_scale;
      shape_sd_ = next.shape_sd;
    }
    fit.settled = fit.gradient < settled;
    fit.jitter = jitter_ = jitter;
    fit.poses.assign(use_.size(), {});
    for (std::size_t v = 0; v < use_.size(); ++v) {
      const Eigen::Index at = per_view * static_cast<Eigen::Index>(v);
      fit.poses[v] = {theta_[at], theta_[at + 1], theta_[at + 2], theta_[at + 3], theta_[at + 4]};
    }
    const auto common = theta_.tail(commons);
    fit.shape.assign(common.data(), common.data() + shapes);
    fit.waves.assign(common.data() + shapes, common.data() + commons);
    fit.shape_sd.clear();
    for (Eigen::Index k = size_ - commons; k < size_ - waves; ++k) fit.shape_sd.push_back(std::sqrt(covariance_(k, k)));
  }

  /// Computes the unknowns of the pixels, and the residual relative to the noise.
  /// @param with_sd computes standard deviations, which takes most of the time; otherwise they are 0
  void back_substitute(PatternFit& fit, bool with_sd) const {
    const std::size_t pixels = data_.rows * data_.columns;
    for (std::vector<double>* values : {&fit.map, &fit.slope}) values->assign(pixels, 0);
    for (std::vector<double>* values : {&fit.map_sd, &fit.slope_sd}) values->assign(pixels, unknown);
    double square = 0, freedom = 0, noise = 0, count = 0;
    const Eigen::RowVectorXd mean = with_sd ? mean_gain() : Eigen::RowVectorXd();
    const Vector all_displaced = displaced();
    const double gauge_variance = jitter_.z * jitter_.z / static_cast<double>(std::ranges::count(use_, 1));
    for (std::size_t i = 0; i < pixels; ++i) {
      const Rows rows = rows_of(i);
      if (rows.view.size() < static_cast<std::size_t>(rows.own + 1)) continue;
      const Own own = own_of(rows);
      const OwnMatrix inverse = own.local.inverse();
      const OwnVector x = inverse * (own.moment - own.cross * theta_);
      fit.map[i] = x[0];
      fit.map_sd[i] = fit.slope_sd[i] = 0;
      if (slope_) fit.slope[i] = x[1];
      if (with_sd) {
        OwnRows gain = inverse * own.cross;
        gain.row(0) -= mean;  // of the map minus its mean
        const OwnMatrix covariance = inverse + gain * covariance_ * gain.transpose();
        fit.map_sd[i] = std::sqrt(covariance(0, 0) + gauge_variance * std::pow(gain.row(0).dot(all_displaced), 2));
        fit.slope_sd[i] = slope_ ? std::sqrt(covariance(1, 1)) : unknown;
      }
      for (std::size_t r = 0; r < rows.view.size(); ++r) {
        const double left = rows.residual[r] - x[0] - (slope_ ? x[1] * rows.arm[r] : 0) - explained(rows, r);
        square += rows.weight[r] * left * left;
        noise += 1 / rows.weight[r];
        count += 1;
      }
      freedom += static_cast<double>(rows.view.size()) - static_cast<double>(rows.own);
    }
    fit.misfit = std::sqrt(square / std::max(freedom - static_cast<double>(size_), 1.0));
    fit.noise = std::sqrt(noise / std::max(count, 1.0));
  }

  /// Root mean square of a view that was not fitted, without and with the pattern, and the noise contribution. Its
  /// offset, position and tilt, the board's shape and the distance-dependent error are not part of the pattern and are
  /// removed from both.
  std::array<double, 3> predict(std::size_t v, const PatternFit& fit) const {
    Matrix a = Matrix::Zero(per_view, per_view);
    Vector before = Vector::Zero(per_view), after = before;
    const PatternView& view = data_.views[v];
    std::vector<double> raw, predicted;
    Vector common(commons);
    common << Eigen::Map<const Vector>(fit.shape.data(), shapes), Eigen::Map<const Vector>(fit.waves.data(), waves);
    std::vector<Eigen::Matrix<double, per_view, 1>> poses;
    double noise = 0;
    for (std::size_t i = 0; i < view.residual.size(); ++i) {
      if (!std::isfinite(view.residual[i]) || !std::isfinite(fit.map_sd[i])) continue;
      poses.push_back(pose_of(view, i));
      raw.push_back(view.residual[i] - common_of(view, i).dot(common));
      predicted.push_back(raw.back() - fit.map[i] - fit.slope[i] * (view.distance[i] - slope_origin));
      a += poses.back() * poses.back().transpose();
      before += poses.back() * raw.back();
      after += poses.back() * predicted.back();
      noise += 1 / double{view.weight[i]};
    }
    // Prior: positions scatter as those of the other views, offsets are free.
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
    Matrix gram;  ///< lower half
    Vector moment;
  };
  // Matrices of one or two unknowns with fixed storage, to avoid an allocation per pixel.
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
    return {1, z, z * y, -z * x, beyond * beyond};  // R_x turns y towards z, R_y turns x away from z
  }

  /// Shape of the board at the pixel, and the waves.
  Eigen::Matrix<double, commons, 1> common_of(const PatternView& view, std::size_t i) const {
    Eigen::Matrix<double, commons, 1> common;
    const auto terms = shape_terms_at(view.place[i][0] / data_.extent, view.place[i][1] / data_.extent);
    common.head<shapes>() = view.along_z[i] * Eigen::Map<const Eigen::Matrix<double, shapes, 1>>(terms.data());
    for (Eigen::Index h = 0; h < waves / 2; ++h) {
      const Harmonic& harmonic = harmonics[static_cast<std::size_t>(h)];
      const double turn = harmonic.order * view.distance[i] / data_.metres_per_radian;
      const double amplitude = harmonic.grows_with_faintness ? view.faintness[i] : 1;
      common[shapes + 2 * h] = amplitude * std::cos(turn);
      common[shapes + 2 * h + 1] = amplitude * std::sin(turn);
    }
    return common;
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
      rows.common.push_back(common_of(view, i));
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
      own.cross.rightCols<commons>() += weighted * rows.common[r].transpose();
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
      sums.gram.block<commons, per_view>(size_ - commons, at) += w * rows.common[r] * rows.pose[r].transpose();
      sums.gram.bottomRightCorner<commons, commons>() += w * rows.common[r] * rows.common[r].transpose();
      sums.moment.segment<per_view>(at) += w * y * rows.pose[r];
      sums.moment.tail<commons>() += w * y * rows.common[r];
    }
    const Eigen::LLT<OwnMatrix> factor(own.local);
    const OwnRows half = factor.matrixL().solve(own.cross);
    for (Eigen::Index k = 0; k < rows.own; ++k)
      sums.gram.selfadjointView<Eigen::Lower>().rankUpdate(half.row(k).transpose(), -1);
    sums.moment -= own.cross.transpose() * factor.solve(own.moment);
  }

  /// Derivative of the map's mean with respect to the common unknowns.
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
    if (const Eigen::Index wave = k - (size_ - waves); wave >= 0)
      return wave_scale_ * wave_amplitude(wave, data_.metres_per_radian);
    if (k >= size_ - commons) return shape_sd_;
    const double sd[] = {jitter.offset, jitter.z, jitter.tilt_x, jitter.tilt_y, jitter.bend};
    return sd[k % per_view];
  }

  /// Displacement of all boards by the same length.
  Vector displaced() const {
    Vector all = Vector::Zero(size_);
    for (std::size_t v = 0; v < use_.size(); ++v) {
      if (use_[v] != 0) all[per_view * static_cast<Eigen::Index>(v) + 1] = 1;
    }
    return all;
  }

  void solve_with(const ViewPose& jitter) {
    const Vector all = displaced() / static_cast<double>(std::ranges::count(use_, 1));
    Matrix system = gram_ + all * all.transpose() / (gauge * gauge);
    for (Eigen::Index k = 0; k < size_; ++k) system(k, k) += 1 / std::pow(prior(k, jitter), 2);
    const Eigen::LLT<Matrix> factor(system);
    if (factor.info() != Eigen::Success || !moment_.allFinite())
      throw std::runtime_error(
          "the boards do not determine a pattern: too few pixels were seen, or none of them twice");
    covariance_ = factor.solve(Matrix::Identity(size_, size_));
    theta_ = factor.solve(moment_);
  }

  struct Improved {
    ViewPose jitter;
    double wave_scale = 1, shape_sd = max_shape;
    double gradient = 0;  ///< maximum of the log marginal likelihood's gradient, divided by the number of unknowns
  };

  /// Most likely jitter, shape and scale of the waves at the current estimates, within their bounds, and the gradient
  /// with respect to their logarithms, which is 0 at a bound beyond which it points.
  Improved improved(const ViewPose& jitter) const {
    Improved next{jitter, wave_scale_, shape_sd_, 0};
    const auto update = [&](double ViewPose::*member, std::initializer_list<Eigen::Index> places, double held) {
      double square = 0, variance = 0, count = -held;
      for (std::size_t v = 0; v < use_.size(); ++v) {
        if (use_[v] == 0) continue;
        for (const Eigen::Index place : places) {
          const Eigen::Index k = per_view * static_cast<Eigen::Index>(v) + place;
          square += theta_[k] * theta_[k];
          variance += covariance_(k, k);
          count += 1;
        }
      }
      next.jitter.*member = improved_sd(jitter.*member, {min_jitter.*member, max_jitter.*member},
                                        {square, variance, count}, next.gradient);
    };
    update(&ViewPose::offset, {0}, 0);
    update(&ViewPose::z, {1}, 1);  // their mean is fixed
    update(&ViewPose::tilt_x, {2, 3}, 0);
    next.jitter.tilt_y = next.jitter.tilt_x;
    update(&ViewPose::bend, {4}, 0);
    const auto shape = Eigen::seqN(size_ - commons, shapes);
    next.shape_sd =
        improved_sd(shape_sd_, {min_shape, max_shape},
                    {theta_(shape).squaredNorm(), covariance_.diagonal()(shape).sum(), double{shapes}}, next.gradient);
    double square = 0, variance = 0;
    for (Eigen::Index wave = 0; wave < waves; ++wave) {
      const Eigen::Index k = size_ - waves + wave;
      square += std::pow(theta_[k] / wave_amplitude(wave, data_.metres_per_radian), 2);
      variance += covariance_(k, k) / std::pow(wave_amplitude(wave, data_.metres_per_radian), 2);
    }
    next.wave_scale =
        improved_sd(wave_scale_, {min_wave_scale, max_wave_scale}, {square, variance, double{waves}}, next.gradient);
    return next;
  }

  double explained(const Rows& rows, std::size_t r) const {
    return rows.pose[r].dot(theta_.segment<per_view>(per_view * rows.view[r])) +
           rows.common[r].dot(theta_.tail<commons>());
  }

  const PatternData& data_;
  ViewUse use_;
  double slope_sd_;
  bool slope_;
  Eigen::Index size_;
  Matrix gram_, covariance_;
  Vector moment_, theta_;
  ViewPose jitter_;
  double wave_scale_ = 1, shape_sd_ = max_shape;
};

}  // namespace tofgraph::calibration::pattern
