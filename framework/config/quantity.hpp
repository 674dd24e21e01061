// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Numbers with units: read from text, checked for their dimension, shown again.
#pragma once

#include <string>
#include <string_view>

namespace tofgraph::config {

/// A number in SI (temperatures in kelvin), or why there is none.
struct Quantity {
  double value = 0;
  std::string problem;  ///< empty when the text was right
  bool ok() const { return problem.empty(); }
};

/// Reads "3.91 mm", "12 mm/ms", "7e6 counts m^2/s", "5 %".
/// @param unit the wanted dimension as an SI unit ("m", "m/s", "" for a pure number)
/// A bare number for a dimension, a unit for a pure number, an unknown unit, NaN and infinity are problems.
Quantity parse_quantity(std::string_view text, std::string_view unit);

/// A value in SI as people write it: 0.00391 of "m" is "3.91 mm". Of several units "m|counts" the first is taken.
std::string format_quantity(double value, std::string_view unit);

/// Reads the unit of stored values, with or without a number: a value of 1 in "mm" or "0.25 mm".
Quantity parse_scale(std::string_view text, std::string_view unit);

}  // namespace tofgraph::config
