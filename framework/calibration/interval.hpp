// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Numbers with an interval for the expected difference of a new campaign.
#pragma once

#include "calibration/board_measurement.hpp"

#include <map>
#include <span>
#include <vector>

namespace tofgraph::calibration {

/// Number with its 95 % interval; NaN if there is only a single level.
struct Interval {
  double value = unknown, low = unknown, high = unknown;
};

/// Half width of a 95 % interval in standard deviations that were estimated from the data: Student's t distribution.
/// @param freedom degrees of freedom
double student_95(double freedom);

/// Square root of the mean of independent mean squares, with its 95 % interval by Student's t distribution of these.
Interval root_of_mean(std::span<const double> mean_squares);

double root_mean_square(const std::vector<double>& values);

/// Root mean square with a 95 % interval by resampling whole levels, because errors within a level have common causes;
/// for fewer than six levels by Student's t distribution of their mean squares.
/// @param by_level values of each level; for a single level the interval is unknown
Interval interval_of(const std::map<double, std::vector<double>>& by_level);

}  // namespace tofgraph::calibration
