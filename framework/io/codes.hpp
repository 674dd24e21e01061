// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Values of an image that are probably codes, such as 65535 of an overflow, and not measurements.
#pragma once

#include <cstddef>
#include <vector>

namespace tofgraph::io {

struct CountedValue {
  double value = 0;
  std::size_t count = 1;  ///< number of elements with this value
};

/// Returns the largest value of the type if it occurs, and of the values that occur ten times or more without any
/// similar value: the smallest one of the type if it is negative, values 2^n - 1, and those far above the other
/// values: 1.5 times, or 10 times if more than 2 % of the values are equal, as on a plain wall; ascending. Values are
/// similar within 0.1 %, and within the usual distance of neighbouring values, so that coarsely quantised measurements
/// are none.
/// @param values in any order, the same one repeatedly or counted; of others than the smallest, positive ones are
/// examined
/// @param largest, smallest value of an integer type; infinity and 0: real numbers; smallest 0: not examined
std::vector<CountedValue> suspected_codes(std::vector<CountedValue> values, double largest, double smallest = 0);

}  // namespace tofgraph::io
