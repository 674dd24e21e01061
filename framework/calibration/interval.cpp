// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/interval.hpp"

#include <boost/math/distributions/students_t.hpp>

#include <algorithm>
#include <cmath>
#include <random>

namespace tofgraph::calibration {

double root_mean_square(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

namespace {

/// Interval by Student's t distribution of the levels' mean squares.
Interval of_few(const std::vector<std::vector<double>>& levels) {
  const auto n = static_cast<double>(levels.size());
  double total = 0;
  for (const std::vector<double>& level : levels) total += static_cast<double>(level.size());
  std::vector<double> squares;  // weighted as in the mean of all values
  for (const std::vector<double>& level : levels) {
    const double rms = root_mean_square(level);
    squares.push_back(rms * rms * static_cast<double>(level.size()) * n / total);
  }
  return root_of_mean(squares);
}

}  // namespace

double student_95(double freedom) { return boost::math::quantile(boost::math::students_t(freedom), 0.975); }

Interval root_of_mean(std::span<const double> mean_squares) {
  const auto n = static_cast<double>(mean_squares.size());
  double mean = 0, variance = 0;
  for (const double s : mean_squares) mean += s / n;
  for (const double s : mean_squares) variance += (s - mean) * (s - mean) / (n - 1);
  const double half = student_95(n - 1) * std::sqrt(variance / n);
  return {std::sqrt(mean), std::sqrt(std::max(mean - half, 0.0)), std::sqrt(mean + half)};
}

Interval interval_of(const std::map<double, std::vector<double>>& by_level) {
  std::vector<std::vector<double>> levels;
  std::vector<double> all, resampled;
  for (const auto& [level, values] : by_level) {
    levels.push_back(values);
    all.insert(all.end(), values.begin(), values.end());
  }
  if (all.empty()) return {};
  if (levels.size() < 2) return {root_mean_square(all), unknown, unknown};
  constexpr std::size_t few = 6;  // resampling fewer levels would give little more than their range
  if (levels.size() < few) return of_few(levels);
  constexpr std::size_t draws = 2000;
  std::mt19937_64 random(1);
  std::uniform_int_distribution<std::size_t> any(0, levels.size() - 1);
  for (std::size_t draw = 0; draw < draws; ++draw) {
    std::vector<double> values;
    for (std::size_t i = 0; i < levels.size(); ++i) {
      const std::vector<double>& level = levels[any(random)];
      values.insert(values.end(), level.begin(), level.end());
    }
    resampled.push_back(root_mean_square(values));
  }
  std::ranges::sort(resampled);
  return {root_mean_square(all), resampled[draws / 40], resampled[draws - 1 - draws / 40]};
}

}  // namespace tofgraph::calibration
