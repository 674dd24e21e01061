// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Numbers with an interval for the expected difference of a new campaign.
#pragma once

#include "calibration/board_measurement.hpp"

#include <map>
#include <vector>

namespace tofgraph::calibration {

/// Number with its 95 % interval; NaN if there is only a single level.
struct Interval {
  double value = unknown, low = unknown, high = unknown;
};

double root_mean_square(const std::vector<double>& values);

/// Root mean square with a 95 % interval by resampling whole levels, because errors within a level have common causes;
/// for fewer than six levels by Student's t distribution of their mean squares.
/// @param by_level values of each level; for a single level the interval is unknown
Interval interval_of(const std::map<double, std::vector<double>>& by_level);

}  // namespace tofgraph::calibration
