// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/robust_camera.hpp"

#include <tofgraph/physics/constants.hpp>
#include <tofgraph/physics/robust.hpp>

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tofgraph::diagnosis {
namespace {

using Complex = std::complex<double>;

/// Columns: an offset (m), distance by ln amplitude and by ln integration time (m), a constant phasor beside the light
/// (counts/s, two parts), then one logarithm of the reflectivity a target.
enum CameraColumn : Eigen::Index { offset, by_light, by_time, real_part, imaginary_part, first_target };
constexpr std::array<double, first_target> usual = {1, 0.02, 0.02, 3000, 3000};  // standard deviations of the priors
constexpr double usual_reflectivity = 3;

constexpr Deviation finest = {2e-3, 0.01};  // m and ln amplitude: what boards and lamps differ by anyway
constexpr double outlier = 6;               // spreads, where a condition counts nothing (Tukey's biweight)
constexpr int steps = 30;
constexpr double nearest_light = 1000, usual_time = 1e-3;  // counts, s: where by_light and by_time are 0

}  // namespace

RobustCamera::RobustCamera(const Measurements& measurements)
    : design_(*measurements.design),
      scale_(physics::metres_per_radian(design_.camera().modulation_frequency)),
      weight_(design_.size(), 0) {
  for (std::size_t i = 0; i < design_.size(); ++i) {
    seen_.push_back(see(measurements, i));
    // A stated reflectivity is in the ideal signal already: these conditions share what the light power is off by.
    const io::Condition& condition = design_.conditions()[i];
    const std::string name = std::isfinite(condition.reflectivity) ? std::string() : condition.target;
    const auto found = std::ranges::find(targets_, name);
    target_.push_back(static_cast<std::size_t>(found - targets_.begin()));
    if (found == targets_.end()) targets_.push_back(name);
  }
  fit();
}

RobustCamera::Seen RobustCamera::see(const Measurements& measurements, std::size_t i) const {
  const Observations& data = measurements.observations[i];
  const std::size_t n = design_.superpixels();
  Seen seen;
  if (!design_.shows_board(i)) return seen;
  std::vector<double> strengths;
  bool has_light = true;
  for (std::size_t s = 0; s < n; ++s) {
    if (!std::isfinite(data.variance[distance * n + s])) continue;
    has_light = has_light && std::isfinite(data.variance[amplitude * n + s]);
    seen.at.push_back(s);
    seen.phasor.push_back(design_.ideal(i)[s].phasor *
                          std::polar(std::exp(data.value[amplitude * n + s]), data.value[distance * n + s] / scale_));
    strengths.push_back(std::abs(seen.phasor.back()));
    seen.inverse += 1.0 / seen.phasor.back();
  }
  if (seen.at.empty()) return seen;
  seen.inverse /= has_light ? static_cast<double>(seen.at.size()) : std::numeric_limits<double>::infinity();
  seen.light = has_light ? std::log(physics::median(strengths)) : io::unknown;
  return seen;
}

bool RobustCamera::tells_light(std::size_t i) const {
  return std::isfinite(seen_[i].light) && support_[target_[i]] >= (weight_[i] > 0 ? 3U : 2U);
}

Deviation RobustCamera::against(std::size_t i, const std::vector<Signal>& ideal) const {
  const Seen& seen = seen_[i];
  Complex mean;
  for (std::size_t k = 0; k < seen.at.size(); ++k) {
    const Complex ratio = seen.phasor[k] / ideal[seen.at[k]].phasor;
    mean += ratio / std::abs(ratio);
  }
  // About the mean direction, so that no half of the pixels wraps.
  std::vector<double> angles, gains;
  for (std::size_t k = 0; k < seen.at.size(); ++k) {
    const Complex ratio = seen.phasor[k] / ideal[seen.at[k]].phasor;
    angles.push_back(std::arg(ratio * std::conj(mean)));
    gains.push_back(std::log(std::abs(ratio)));
  }
  return {scale_ * (std::arg(mean) + physics::median(angles)), physics::median(gains)};
}

Eigen::Matrix2Xd RobustCamera::rows(std::size_t i, double time, std::size_t target) const {
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

Deviation RobustCamera::rest_of(std::size_t i, Deviation raw, double time, std::size_t target) const {
  const Eigen::Vector2d expected = rows(i, time, target) * value_;
  const double period = 2 * std::numbers::pi * scale_;
  return {std::remainder(raw.length - expected(0), period), raw.light - expected(1)};
}

void RobustCamera::fit() {
  const std::size_t n = design_.size();
  std::vector<Deviation> raw(n);
  std::vector<double> lengths;
  std::vector<std::vector<double>> lights(targets_.size());
  for (std::size_t i = 0; i < n; ++i) {
    if (!knows(i)) continue;
    raw[i] = against(i, design_.ideal(i));
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

/// Spread and weights about the present values, then new values.
void RobustCamera::update(const std::vector<Deviation>& raw) {
  const std::size_t n = design_.size();
  std::vector<double> lengths, lights;
  std::vector<Deviation> rest(n);
  for (std::size_t i = 0; i < n; ++i) {
    if (!knows(i)) continue;
    rest[i] = rest_of(i, raw[i], design_.conditions()[i].integration_time, target_[i]);
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
    const Eigen::Matrix2Xd x = rows(i, design_.conditions()[i].integration_time, target_[i]);
    const Eigen::Vector2d present = x * value_;
    const double wl = weight_[i] / std::pow(spread_.length, 2);
    const double wa = has_light ? weight_[i] / std::pow(spread_.light, 2) : 0;
    normal += wl * x.row(0).transpose() * x.row(0) + wa * x.row(1).transpose() * x.row(1);
    // Of what is left about the present values, for the length repeats itself.
    right += wl * x.row(0).transpose() * (present(0) + rest[i].length) +
             wa * x.row(1).transpose() * (present(1) + rest[i].light);
  }
  value_ = normal.ldlt().solve(right);
}

Deviation RobustCamera::rest_as(std::size_t i, std::size_t j) const {
  return rest_of(i, against(i, design_.ideal(j)), design_.conditions()[j].integration_time, target_[j]);
}

Deviation RobustCamera::rest_on(std::size_t i, std::size_t target) const {
  return rest_of(i, against(i, design_.ideal(i)), design_.conditions()[i].integration_time, target);
}

Deviation RobustCamera::rest_with(std::size_t i, double time) const {
  Deviation raw = against(i, design_.ideal(i));
  raw.light -= std::log(time / design_.conditions()[i].integration_time);
  return rest_of(i, raw, time, target_[i]);
}

double RobustCamera::distance_by_light(std::size_t i) const {
  return design_.conditions()[i].board_distance * std::exp(-rest(i).light / 2);
}

std::pair<double, Deviation> RobustCamera::at_distance(std::size_t i, double start) const {
  io::Condition condition = design_.conditions()[i];
  condition.board_distance = start;
  Deviation rest;
  constexpr int last = 3;
  for (int step = 0; step <= last; ++step) {
    const Design there(design_.camera_pointer(), design_.physical(), {condition},
                       design_.superpixels() == 1 ? single : grid);
    rest = rest_of(i, against(i, there.ideal(0)), condition.integration_time, target_[i]);
    if (step < last)
      condition.board_distance = std::max(condition.board_distance + rest.length, 1.01 * there.camera().focal_length);
  }
  return {condition.board_distance, rest};
}

}  // namespace tofgraph::diagnosis
