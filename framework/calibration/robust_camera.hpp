// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Camera model with a few parameters, fitted to the medians of all conditions with outliers down-weighted.
/// Header-only: calibration and diagnosis compile it into themselves.
#pragma once

#include "calibration/board_phasors.hpp"

#include <tofgraph/physics/constants.hpp>
#include <tofgraph/physics/robust.hpp>

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace tofgraph::calibration {

/// Deviation of a condition from an ideal camera or from its expectation.
struct Deviation {
  double length = 0;  ///< half path, m, within half an unambiguous range
  double light = 0;   ///< difference of ln amplitude
};

class RobustCamera {
 public:
  /// @param data must outlive this object
  explicit RobustCamera(const BoardPhasors& data);

  /// Robust standard deviations of rest() over the conditions.
  const Deviation& spread() const { return spread_; }
  /// Returns true if the condition has data; if its amplitude can be tested, i.e. two others of its target fit.
  bool knows(std::size_t condition) const { return !seen_[condition].phasor.empty(); }
  bool tells_light(std::size_t condition) const;
  const std::vector<std::string>& targets() const { return targets_; }
  bool knows_target(std::size_t target) const { return support_[target] >= 2; }

  /// Deviation of a condition from the expectation by the others.
  Deviation rest(std::size_t condition) const { return rest_as(condition, condition); }
  /// The same for its data with the settings of another condition, another target, or another integration time, s.
  Deviation rest_as(std::size_t data, std::size_t settings) const;
  Deviation rest_on(std::size_t condition, std::size_t target) const;
  Deviation rest_with(std::size_t condition, double integration_time) const;
  /// ln of the amplitude expected from the others, counts.
  double expected_light(std::size_t condition) const { return seen_[condition].light - rest(condition).light; }
  /// Distance of the board according to its amplitude, m: light decreases with the square of the distance.
  double distance_by_light(std::size_t condition) const;
  /// Distance according to the phase in the period of `start`, m, and the residual there.
  std::pair<double, Deviation> at_distance(std::size_t condition, double start) const;

 private:
  struct Seen {
    std::vector<std::size_t> at;               ///< positions with a finite value
    std::vector<std::complex<double>> phasor;  ///< measured, counts
    std::complex<double> inverse;              ///< mean of 1 / phasor; 0 if the amplitude is unknown
    double light = 0;                          ///< ln of the median amplitude
  };
  Seen see(std::size_t condition) const;
  Deviation against(std::size_t condition, const BoardPhasors::Phasors& ideal) const;
  Deviation rest_of(std::size_t condition, Deviation raw, double integration_time, std::size_t target) const;
  /// Rows of the fit for the length and for the light.
  Eigen::Matrix2Xd rows(std::size_t condition, double integration_time, std::size_t target) const;
  void fit();
  void update(const std::vector<Deviation>& raw);

  using Complex = std::complex<double>;
  /// Columns: an offset (m), distance by ln amplitude and by ln integration time (m), a constant phasor added to the
  /// light (counts/s, two parts), then the logarithm of one reflectivity per target.
  enum Column : Eigen::Index { offset, by_light, by_time, real_part, imaginary_part, first_target };
  static constexpr std::array<double, first_target> usual = {1, 0.02, 0.02, 3000, 3000};  // sd of the priors
  static constexpr double usual_reflectivity = 3;
  static constexpr Deviation finest = {2e-3, 0.01};  // m and ln amplitude: minimum scatter of boards and lamps
  static constexpr double outlier = 6;               // spreads beyond which the weight is 0 (Tukey's biweight)
  static constexpr int steps = 30;
  static constexpr double nearest_light = 1000, usual_time = 1e-3;  // counts, s: zeros of by_light and by_time

  const BoardPhasors& data_;
  double scale_;  ///< m per rad
  std::vector<Seen> seen_;
  std::vector<std::string> targets_;
  std::vector<std::size_t> target_;   ///< per condition
  std::vector<std::size_t> support_;  ///< number of fitting conditions per target
  std::vector<double> weight_;
  Eigen::VectorXd value_;  ///< values of the columns
  Deviation spread_;
};

inline RobustCamera::RobustCamera(const BoardPhasors& data)
    : data_(data), scale_(physics::metres_per_radian(data.modulation_frequency)), weight_(data.size(), 0) {
  for (std::size_t i = 0; i < data_.size(); ++i) {
    seen_.push_back(see(i));
    // A stated reflectivity is part of the ideal signal: these conditions share the error of the light power.
    const io::Condition& condition = data_.conditions[i];
    const std::string name = std::isfinite(condition.reflectivity) ? std::string() : condition.target;
    const auto found = std::ranges::find(targets_, name);
    target_.push_back(static_cast<std::size_t>(found - targets_.begin()));
    if (found == targets_.end()) targets_.push_back(name);
  }
  fit();
}

inline RobustCamera::Seen RobustCamera::see(std::size_t i) const {
  Seen seen;
  std::vector<double> strengths;
  for (std::size_t s = 0; s < data_.measured[i].size(); ++s) {
    const std::complex<double> phasor = data_.measured[i][s];
    if (!std::isfinite(std::abs(phasor))) continue;
    seen.at.push_back(s);
    seen.phasor.push_back(phasor);
    strengths.push_back(std::abs(phasor));
    seen.inverse += 1.0 / phasor;
  }
  if (seen.at.empty()) return seen;
  const bool has_light = data_.has_amplitude[i] != 0;
  seen.inverse /= has_light ? static_cast<double>(seen.at.size()) : std::numeric_limits<double>::infinity();
  seen.light = has_light ? std::log(physics::median(strengths)) : io::unknown;
  return seen;
}

inline bool RobustCamera::tells_light(std::size_t i) const {
  return std::isfinite(seen_[i].light) && support_[target_[i]] >= (weight_[i] > 0 ? 3U : 2U);
}

inline Deviation RobustCamera::against(std::size_t i, const BoardPhasors::Phasors& ideal) const {
  const Seen& seen = seen_[i];
  Complex mean;
  for (std::size_t k = 0; k < seen.at.size(); ++k) {
    const Complex ratio = seen.phasor[k] / ideal[seen.at[k]];
    mean += ratio / std::abs(ratio);
  }
  // Relative to the mean direction, to avoid wrapping.
  std::vector<double> angles, gains;
  for (std::size_t k = 0; k < seen.at.size(); ++k) {
    const Complex ratio = seen.phasor[k] / ideal[seen.at[k]];
    angles.push_back(std::arg(ratio * std::conj(mean)));
    gains.push_back(std::log(std::abs(ratio)));
  }
  return {scale_ * (std::arg(mean) + physics::median(angles)), physics::median(gains)};
}

inline Eigen::Matrix2Xd RobustCamera::rows(std::size_t i, double time, std::size_t target) const {
  Eigen::Matrix2Xd rows = Eigen::Matrix2Xd::Zero(2, first_target + static_cast<Eigen::Index>(targets_.size()));
  const Seen& seen = seen_[i];
  const Complex beside = time * seen.inverse;
  rows(0, offset) = 1;
  if (std::isfinite(seen.light)) rows(0, by_light) = seen.light - std::log(nearest_light);
  rows(0, by_time) = std::log(time / usual_time);
  rows(0, real_part) = scale_ * beside.imag();
  rows(0, imaginary_part) = scale_ * beside.real();
  rows(1, real_part) = beside.real();
  rows(1, imaginary_part) = -beside.imag();
  rows(1, first_target + static_cast<Eigen::Index>(target)) = 1;
  return rows;
}

inline Deviation RobustCamera::rest_of(std::size_t i, Deviation raw, double time, std::size_t target) const {
  const Eigen::Vector2d expected = rows(i, time, target) * value_;
  const double period = 2 * std::numbers::pi * scale_;
  return {std::remainder(raw.length - expected(0), period), raw.light - expected(1)};
}

inline void RobustCamera::fit() {
  const std::size_t n = data_.size();
  std::vector<Deviation> raw(n);
  std::vector<double> lengths;
  std::vector<std::vector<double>> lights(targets_.size());
  for (std::size_t i = 0; i < n; ++i) {
    if (!knows(i)) continue;
    raw[i] = against(i, data_.ideal[i]);
    lengths.push_back(raw[i].length);
    if (std::isfinite(seen_[i].light)) lights[target_[i]].push_back(raw[i].light);
  }
  value_ = Eigen::VectorXd::Zero(first_target + static_cast<Eigen::Index>(targets_.size()));
  support_.assign(targets_.size(), 0);
  if (lengths.empty()) return;
  value_(offset) = physics::median(lengths);
  for (std::size_t t = 0; t < targets_.size(); ++t)
    value_(first_target + static_cast<Eigen::Index>(t)) = lights[t].empty() ? 0 : physics::median(lights[t]);
  for (int step = 0; step < steps; ++step) update(raw);
}

/// Updates spread and weights at the current values, then the values.
inline void RobustCamera::update(const std::vector<Deviation>& raw) {
  const std::size_t n = data_.size();
  std::vector<double> lengths, lights;
  std::vector<Deviation> rest(n);
  for (std::size_t i = 0; i < n; ++i) {
    if (!knows(i)) continue;
    rest[i] = rest_of(i, raw[i], data_.conditions[i].integration_time, target_[i]);
    lengths.push_back(std::abs(rest[i].length));
    if (std::isfinite(seen_[i].light)) lights.push_back(std::abs(rest[i].light));
  }
  spread_ = {std::max(finest.length, physics::sd_of_deviations * physics::median(lengths)),
             std::max(finest.light, lights.empty() ? 0 : physics::sd_of_deviations * physics::median(lights))};
  const Eigen::Index columns = value_.size();
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(columns, columns);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(columns);
  support_.assign(targets_.size(), 0);
  for (Eigen::Index c = 0; c < columns; ++c)
    normal(c, c) = 1 / std::pow(c < first_target ? usual.at(static_cast<std::size_t>(c)) : usual_reflectivity, 2);
  for (std::size_t i = 0; i < n; ++i) {
    weight_[i] = 0;
    if (!knows(i)) continue;
    const bool has_light = std::isfinite(seen_[i].light);
    const double far =
        std::max(std::abs(rest[i].length) / spread_.length, has_light ? std::abs(rest[i].light) / spread_.light : 0);
    if (far >= outlier) continue;
    weight_[i] = std::pow(1 - std::pow(far / outlier, 2), 2);
    if (has_light) ++support_[target_[i]];
    const Eigen::Matrix2Xd x = rows(i, data_.conditions[i].integration_time, target_[i]);
    const Eigen::Vector2d present = x * value_;
    const double wl = weight_[i] / std::pow(spread_.length, 2);
    const double wa = has_light ? weight_[i] / std::pow(spread_.light, 2) : 0;
    normal += wl * x.row(0).transpose() * x.row(0) + wa * x.row(1).transpose() * x.row(1);
    // Residuals are added to the current values, because the length is periodic.
    right += wl * x.row(0).transpose() * (present(0) + rest[i].length) +
             wa * x.row(1).transpose() * (present(1) + rest[i].light);
  }
  value_ = normal.ldlt().solve(right);
}

inline Deviation RobustCamera::rest_as(std::size_t i, std::size_t j) const {
  return rest_of(i, against(i, data_.ideal[j]), data_.conditions[j].integration_time, target_[j]);
}

inline Deviation RobustCamera::rest_on(std::size_t i, std::size_t target) const {
  return rest_of(i, against(i, data_.ideal[i]), data_.conditions[i].integration_time, target);
}

inline Deviation RobustCamera::rest_with(std::size_t i, double time) const {
  Deviation raw = against(i, data_.ideal[i]);
  raw.light -= std::log(time / data_.conditions[i].integration_time);
  return rest_of(i, raw, time, target_[i]);
}

inline double RobustCamera::distance_by_light(std::size_t i) const {
  return data_.conditions[i].board_distance * std::exp(-rest(i).light / 2);
}

inline std::pair<double, Deviation> RobustCamera::at_distance(std::size_t i, double start) const {
  io::Condition condition = data_.conditions[i];
  condition.board_distance = start;
  Deviation rest;
  constexpr int last = 3;
  for (int step = 0; step <= last; ++step) {
    rest = rest_of(i, against(i, data_.ideal_of(condition)), condition.integration_time, target_[i]);
    if (step < last) condition.board_distance = std::max(condition.board_distance + rest.length, data_.min_distance);
  }
  return {condition.board_distance, rest};
}

}  // namespace tofgraph::calibration
