// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Status of a parameter, and its value with no more digits than the data determine.
#pragma once

#include "diagnosis/model/candidate.hpp"
#include "diagnosis/model/validation.hpp"

#include <string>
#include <string_view>

namespace tofgraph::diagnosis {

enum class ParameterStatus {
  determined,
  consistent_with_zero,  ///< the interval of a size holds the value that changes nothing
  not_determined         ///< the interval is the prior's, or all that the parameter may be
};

/// @param variance of the fit, in squares of typical values; NaN: not known, as of maps
ParameterStatus parameter_status(const FreeParameter& parameter, const Interval& interval, double variance);
/// "determined", "consistent_with_zero" or "not_determined".
std::string_view parameter_status_name(ParameterStatus status);

/// A value in a lab's units, lengths in mm, times in ms, angles in deg, with two digits of its uncertainty:
/// "4.001 mm ± 0.020 mm"; "1.00 ms (0.90 ms to 2.00 ms)" where the ends are not as far
/// from it, by a fifth. @param unit SI @param digits where no interval is known
std::string with_uncertainty(double value, const Interval& interval, std::string_view unit, int digits = 3);

}  // namespace tofgraph::diagnosis
