// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/interval.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace tofgraph::calibration {

double root_mean_square(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum / static_cast<double>(values.size()));
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
