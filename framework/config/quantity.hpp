// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Numbers with units: parsing, check of the dimension, output.
#pragma once

#include <string>
#include <string_view>

namespace tofgraph::config {

/// Number in SI (temperatures in kelvin), or the reason why there is none.
struct Quantity {
  double value = 0;
  std::string problem;  ///< empty if the text is valid
  bool ok() const { return problem.empty(); }
};

/// Parses "3.91 mm", "12 mm/ms", "7e6 counts m^2/s", "5 %".
/// @param unit the required dimension as an SI unit ("m", "m/s", "" for a pure number)
/// Errors are a bare number where a dimension is required, a unit on a pure number, an unknown unit, NaN and infinity.
Quantity parse_quantity(std::string_view text, std::string_view unit);

/// Formats an SI value in a convenient unit: 0.00391 of "m" is "3.91 mm". Of "m|counts" the first unit is used.
std::string format_quantity(double value, std::string_view unit);

/// Parses the unit of stored values, with or without a number: a value of 1 in "mm" or "0.25 mm".
Quantity parse_scale(std::string_view text, std::string_view unit);

}  // namespace tofgraph::config
