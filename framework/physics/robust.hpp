// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Statistics that are robust against outliers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <ranges>

namespace tofgraph::physics {

/// Ratio of the standard deviation of normal values to their median absolute deviation.
inline constexpr double sd_of_deviations = 1.4826;

/// Median of the values, for an even number the upper of the middle two; NaN if there are none. Reorders the values.
template <std::ranges::random_access_range Values> std::ranges::range_value_t<Values> median(Values&& values) {
  using Value = std::ranges::range_value_t<Values>;
  const auto count = std::ranges::ssize(values);
  if (count == 0) return std::numeric_limits<Value>::quiet_NaN();
  const auto middle = std::ranges::begin(values) + count / 2;
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace tofgraph::physics
