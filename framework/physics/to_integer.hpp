// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Conversion of measured values to whole numbers.
#pragma once

#include <cmath>
#include <concepts>
#include <limits>

namespace tofgraph::physics {

/// Nearest integer of a value, halves away from zero, clamped to the range of the type. Unlike a cast it is defined
/// for every value.
/// @param otherwise result for NaN
template <std::integral Int> Int to_integer(double value, Int otherwise) {
  if (std::isnan(value)) return otherwise;
  const double whole = std::round(value);
  if (whole <= static_cast<double>(std::numeric_limits<Int>::min())) return std::numeric_limits<Int>::min();
  if (whole >= static_cast<double>(std::numeric_limits<Int>::max())) return std::numeric_limits<Int>::max();
  return static_cast<Int>(whole);
}

}  // namespace tofgraph::physics
