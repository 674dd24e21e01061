// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Errors of scattered offset samples by an exhaustive search in double precision.
#pragma once

#include <tofgraph/physics/offset_table.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace tofgraph::tests {

/// Errors T - z, in m, that the eight nearest of at least nine samples give. The first counts the nearest; the second
/// counts the ninth for the eighth if both are equally far to the precision of float, so that either may count.
/// Unknown reflectivities (NaN) are not an axis.
inline std::pair<double, double> exhaustive_errors(const std::vector<physics::OffsetSample>& samples, double z,
                                                   double reflectivity, double time) {
  const auto place_of = [](double depth, double rho, double at) {
    return std::array{depth, std::log(rho), std::log(at)};
  };
  std::array<double, 3> low{1e9, 1e9, 1e9}, high{-1e9, -1e9, -1e9};
  for (const physics::OffsetSample& s : samples) {
    const auto place = place_of(s.depth, s.reflectivity, s.integration_time);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::fmin(low[axis], place[axis]);
      high[axis] = std::fmax(high[axis], place[axis]);
    }
  }
  std::vector<std::pair<double, double>> nearest;
  const auto here = place_of(z, reflectivity, time);
  for (const physics::OffsetSample& s : samples) {
    const auto there = place_of(s.depth, s.reflectivity, s.integration_time);
    double square = 1e-18;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (std::isnan(there[axis])) continue;
      const double step = (axis == 0 ? 10 : 1) * (there[axis] - here[axis]) / (high[axis] - low[axis]);
      square += step * step;
    }
    nearest.emplace_back(square, s.distance - s.depth);
  }
  std::partial_sort(nearest.begin(), nearest.begin() + 9, nearest.end());
  const auto mean = [&] {
    double sum = 0, weight = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      sum += nearest[i].second / nearest[i].first;
      weight += 1 / nearest[i].first;
    }
    return sum / weight;
  };
  const double first = mean();
  if (nearest[8].first < nearest[7].first * (1 + 1e-5)) std::swap(nearest[7], nearest[8]);
  return {first, mean()};
}

}  // namespace tofgraph::tests
