// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Numbers with an interval that says how far a new campaign may differ.
#pragma once

#include "calibration/board_measurement.hpp"

#include <map>
#include <vector>

namespace tofgraph::calibration {

/// A number with its 95 % interval; NaN: a single level tells none.
struct Interval {
  double value = unknown, low = unknown, high = unknown;
};

double root_mean_square(const std::vector<double>& values);

/// Root mean square with a 95 % interval by resampling whole levels, whose errors have common causes; of fewer than six
/// levels Student's of their mean squares.
/// @param by_level the values of each level; of a single level the interval is not known
Interval interval_of(const std::map<double, std::vector<double>>& by_level);

}  // namespace tofgraph::calibration
