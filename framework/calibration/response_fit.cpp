// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/response.hpp"

#include "calibration/interval.hpp"

#include <Eigen/Dense>
#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <stdexcept>

namespace tofgraph::calibration {
namespace {

constexpr double light_error = 5e-3;    ///< relative: change of an amplitude by harmonics of the correlation
constexpr double count_error = 1;       ///< counts
constexpr double min_ratio = 1.5;       ///< ratio of the amplitudes that is needed to fit a dark level
constexpr double outlying = 6;          ///< robust standard deviations of the map
constexpr std::size_t level_count = 3;  ///< minimum number of levels for holding out

using Left = std::optional<double>;  ///< the held-out level

double median_of_known(const std::vector<double>& values) {
  std::vector<double> known;
  for (const double v : values) {
    if (std::isfinite(v)) known.push_back(v);
  }
  return known.empty() ? unknown : physics::median(std::move(known));
}

double robust_sd(const std::vector<double>& values, double middle) {
  std::vector<double> deviations;
  for (const double v : values) {
    if (std::isfinite(v)) deviations.push_back(std::abs(v - middle));
  }
  return deviations.empty() ? unknown : physics::sd_of_deviations * physics::median(std::move(deviations));
}

/// Mean intensity of a tap = dark + rate t_int + slope amplitude, slope = 1 / (2 contrast).
struct Line {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();  ///< slope, dark, rate
  Eigen::Vector3d sd = Eigen::Vector3d::Constant(unknown);

  double at(double amplitude, double integration_time) const {
    return value[0] * amplitude + value[1] + value[2] * integration_time;
  }
};

class ResponseSolver {
 public:
  explicit ResponseSolver(const ResponseData& data) : data_(data) {
    std::set<double> times;
    for (const ResponseCondition& c : data.conditions) times.insert(c.integration_time);
    std::vector<double> medians;
    for (const ResponseCondition& c : data.conditions)
      medians.push_back(median_of_known({c.amplitude.begin(), c.amplitude.end()}));
    std::erase_if(medians, [](double m) { return !std::isfinite(m); });
    if (medians.size() < 2) return;
    const auto [low, high] = std::ranges::minmax(medians);
    if (medians.size() >= 3 && high > min_ratio * low) terms_ = times.size() > 1 && medians.size() >= 5 ? 3 : 2;
  }

  Eigen::Index terms() const { return terms_; }

  /// Fit of a pixel; nullopt if it has too few values or shows no light.
  std::optional<Line> line(std::size_t pixel, Left left) const {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    Eigen::Index count = 0;
    double squares = 0;
    for (const ResponseCondition& c : data_.conditions) {
      if ((left && c.level == *left) || !std::isfinite(c.intensity[pixel])) continue;
      const Eigen::Vector3d x(c.amplitude[pixel], 1, c.integration_time / time_scale);
      const double y = c.intensity[pixel], weight = weight_of(y);
      normal += weight * x * x.transpose();
      right += weight * y * x;
      squares += weight * y * y;
      ++count;
    }
    if (count < terms_ + (terms_ > 1 ? 1 : 0)) return std::nullopt;
    const Eigen::MatrixXd system = normal.topLeftCorner(terms_, terms_);
    const Eigen::LDLT<Eigen::MatrixXd> factor(system);
    if (factor.info() != Eigen::Success || !(factor.rcond() > 1e-14)) return std::nullopt;
    Line line;
    line.value.head(terms_) = factor.solve(right.head(terms_));
    if (!(line.value[0] > 0)) return std::nullopt;
    const Eigen::MatrixXd inverse = factor.solve(Eigen::MatrixXd::Identity(terms_, terms_));
    const double rest = std::max(squares - line.value.head(terms_).dot(right.head(terms_)), 0.0);
    const double variance = count > terms_ ? rest / static_cast<double>(count - terms_) : unknown;
    for (Eigen::Index k = 0; k < terms_; ++k) line.sd[k] = std::sqrt(variance * inverse(k, k));
    line.value[2] /= time_scale;
    line.sd[2] /= time_scale;
    return line;
  }

  /// Mean of ln(amplitude / (reflectivity t / D_t^2)) over the conditions with a known reflectivity, and its sd.
  std::array<double, 2> log_gain(std::size_t pixel, Left left) const {
    double sum = 0, square = 0, count = 0;
    for (const ResponseCondition& c : data_.conditions) {
      if ((left && c.level == *left) || c.light.empty()) continue;
      const double ratio = static_cast<double>(c.amplitude[pixel]) / static_cast<double>(c.light[pixel]);
      if (!(ratio > 0) || !std::isfinite(ratio)) continue;
      sum += std::log(ratio);
      square += std::log(ratio) * std::log(ratio);
      count += 1;
    }
    if (count == 0) return {unknown, unknown};
    const double mean = sum / count;
    return {mean, count > 1 ? std::sqrt(std::max(square - count * mean * mean, 0.0) / (count - 1) / count) : unknown};
  }

 private:
  static constexpr double time_scale = 1e-3;  ///< s, scales the terms to similar magnitude
  static double weight_of(double intensity) {
    return 1 / (count_error * count_error + std::pow(light_error * intensity, 2));
  }

  const ResponseData& data_;
  Eigen::Index terms_ = 1;
};

/// ln gain on the axis: fit of a parabola over tan^2 of the angle, without outliers.
double on_axis(const std::vector<double>& log_gain, const std::vector<double>& angle) {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  double limit = std::numeric_limits<double>::infinity(), middle = median_of_known(log_gain);
  value[0] = middle;
  if (!std::isfinite(middle)) return unknown;
  for (int round = 0; round < 5; ++round) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Identity() * 1e-9;
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    std::vector<double> rest;
    for (std::size_t i = 0; i < log_gain.size(); ++i) {
      if (!std::isfinite(log_gain[i])) continue;
      const Eigen::Vector3d x(1, angle[i], angle[i] * angle[i]);
      rest.push_back(log_gain[i] - x.dot(value));
      if (std::abs(rest.back()) > limit) continue;
      normal += x * x.transpose();
      right += log_gain[i] * x;
    }
    value = normal.ldlt().solve(right);
    limit = std::max(4 * robust_sd(rest, 0), 1e-6);
  }
  return value[0];
}

/// Both parameters from all conditions except one level.
struct Numbers {
  double contrast = unknown, gain = unknown;
};

/// Sets Student's interval by the jackknife over whole levels.
void set_interval(double value, const std::vector<double>& without, ResponseValue& result) {
  result.value = value;
  const auto n = static_cast<double>(without.size());
  if (without.size() < level_count || std::ranges::any_of(without, [](double w) { return !std::isfinite(w); })) return;
  const Moments moments = moments_of(without);
  result.sd = std::sqrt((n - 1) * (n - 1) / n) * moments.sd;
  const double half = student_95(n - 1) * result.sd;
  result.low = value - half;
  result.high = value + half;
}

class ResponseEstimate {
 public:
  ResponseEstimate(const ResponseData& data, const tofgraph_camera& camera)
      : data_(data), camera_(camera), solver_(data), pixels_(data.rows * data.columns) {}

  ResponseFit fit() {
    ResponseFit result;
    write_maps(result);
    const Numbers all = numbers(std::nullopt, nullptr);
    if (!std::isfinite(all.contrast))
      throw std::invalid_argument("no pixel shows the relation between the light of its taps and the amplitude");
    std::set<double> levels;
    for (const ResponseCondition& c : data_.conditions) levels.insert(c.level);
    result.levels = levels.size();
    std::vector<double> contrasts, gains;
    Errors errors;
    for (const double level : levels) {
      if (levels.size() < level_count) break;
      const Numbers without = numbers(level, &errors);
      contrasts.push_back(without.contrast);
      gains.push_back(without.gain);
    }
    set_interval(all.contrast, contrasts, result.contrast);
    set_interval(all.gain, gains, result.gain);
    result.before = robust_sd(errors.before, 0);
    result.after = robust_sd(errors.after, 0);
    result.gain_before = robust_sd(errors.gain_before, 0);
    result.gain_after = robust_sd(errors.gain_after, 0);
    return result;
  }

 private:
  struct Errors {
    std::vector<double> before, after, gain_before, gain_after;  ///< relative
  };

  void write_maps(ResponseFit& result) const {
    std::vector<double> rates;
    for (ResponseValue* v : {&result.contrast, &result.gain, &result.dark}) {
      v->map.assign(pixels_, unknown);
      v->map_sd.assign(pixels_, unknown);
    }
    for (std::size_t i = 0; i < pixels_; ++i) {
      if (const std::optional<Line> line = solver_.line(i, std::nullopt)) {
        const double slope = line->value[0];
        result.contrast.map[i] = 1 / (2 * slope);
        result.contrast.map_sd[i] = line->sd[0] / (2 * slope * slope);
        if (solver_.terms() > 1) result.dark.map[i] = line->value[1];
        result.dark.map_sd[i] = line->sd[1];
        if (solver_.terms() > 2) rates.push_back(line->value[2]);
      }
      const auto [log_gain, sd] = solver_.log_gain(i, std::nullopt);
      result.gain.map[i] = std::exp(log_gain);
      result.gain.map_sd[i] = result.gain.map[i] * sd;
    }
    result.dark.value = median_of_known(result.dark.map);
    result.dark_rate = rates.empty() ? unknown : physics::median(std::move(rates));
    const double middle = median_of_known(result.contrast.map), spread = robust_sd(result.contrast.map, middle);
    for (const double c : result.contrast.map) {
      result.unknown_pixels += std::isfinite(c) ? 0 : 1;
      result.outlying_pixels += std::abs(c - middle) > outlying * spread ? 1 : 0;
    }
  }

  /// @param errors those of the held-out level are appended; null: no level is held out
  Numbers numbers(Left left, Errors* errors) const {
    std::vector<double> contrasts, gains(pixels_, unknown);
    std::vector<std::optional<Line>> lines(pixels_);
    for (std::size_t i = 0; i < pixels_; ++i) {
      lines[i] = solver_.line(i, left);
      if (lines[i]) contrasts.push_back(1 / (2 * lines[i]->value[0]));
      gains[i] = solver_.log_gain(i, left)[0];
    }
    Numbers result{.contrast = median_of_known(contrasts), .gain = std::exp(on_axis(gains, data_.angle))};
    if (errors == nullptr) return result;
    for (const ResponseCondition& c : data_.conditions) {
      if (c.level != *left) continue;
      for (std::size_t i = 0; i < pixels_; ++i) add_errors(c, i, lines[i], gains[i], *errors);
    }
    return result;
  }

  void add_errors(const ResponseCondition& c, std::size_t i, const std::optional<Line>& line, double log_gain,
                  Errors& errors) const {
    const double a = c.amplitude[i], light = c.intensity[i];
    if (line && light > 0) {
      errors.before.push_back((light - a / (2 * camera_.contrast)) / light);
      errors.after.push_back((light - line->at(a, c.integration_time)) / light);
    }
    if (c.light.empty() || !(a > 0) || !std::isfinite(log_gain) || !std::isfinite(c.light[i])) return;
    errors.gain_before.push_back(1 - camera_.gain * static_cast<double>(c.light[i]) / a);
    errors.gain_after.push_back(1 - std::exp(log_gain) * static_cast<double>(c.light[i]) / a);
  }

  const ResponseData& data_;
  const tofgraph_camera& camera_;
  ResponseSolver solver_;
  std::size_t pixels_;
};

}  // namespace

ResponseFit fit_response(const ResponseData& data, const tofgraph_camera& camera) {
  if (data.conditions.size() < 2)
    throw std::invalid_argument("fewer than two usable conditions: a contrast needs several");
  return ResponseEstimate(data, camera).fit();
}

}  // namespace tofgraph::calibration
