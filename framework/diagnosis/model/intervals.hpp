// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Intervals of the parameters of a fit, and whether these data determine them.
#pragma once

#include "diagnosis/model/candidate.hpp"
#include "diagnosis/model/fit.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace tofgraph::diagnosis {

/// Assumption of intervals about the refinements that the data did not demand.
enum class Refinements {
  as_they_are,   ///< their sizes are off
  may_be_there,  ///< normal about off, a typical value their standard deviation: too small to be seen is not zero
};
struct Interval {
  double low = 0, high = 0;
};
/// 95 % intervals of the free parameters of all terms, in SI: conditions are drawn with replacement, each draw is one
/// step of least squares. Never narrower than the covariance of the fit says.
/// @param lack_of_fit chi-square over its expectation: where more than 1, intervals are its root times as wide
/// @param refinements what of those that a term does not have
std::vector<Interval> intervals(const Problem& problem, const ModelFit& fit, std::uint64_t seed, double lack_of_fit = 1,
                                Refinements refinements = Refinements::may_be_there);

// ---- Status of a parameter, and its value with no more digits than the data determine ----

enum class ParameterStatus {
  determined,
  consistent_with_zero,  ///< the interval of a size holds the value that changes nothing
  not_determined         ///< the interval is the prior's, or all that the parameter may be
};

/// @param variance of the fit, in squares of typical values; NaN: not known, as of maps
ParameterStatus parameter_status(const FreeParameter& parameter, const Interval& interval, double variance);
/// The word of a gap report: "determined", "holds_zero" or "not_determined".
std::string_view parameter_status_name(ParameterStatus status);

/// A value in a lab's units, lengths in mm, times in ms, angles in deg, with two digits of its uncertainty:
/// "4.001 mm ± 0.020 mm"; "1.00 ms (0.90 ms to 2.00 ms)" where the ends are not as far
/// from it, by a fifth. @param unit SI @param digits where no interval is known
std::string with_uncertainty(double value, const Interval& interval, std::string_view unit, int digits = 3);

// ---- Identifiability of the values of an effect ----

/// Reason for which the data do not determine the values of a term.
struct Unidentified {
  std::string why;                       ///< empty: they do
  std::optional<std::size_t> nonlinear;  ///< of its parameters, that may be anything, or is at its limit
  bool at_limit = false;                 ///< it is the latter
};

/// Message for a nonlinear parameter that is practically at its minimum: one that may be much more than is
/// typical, as what can be from none to all is at its ends by itself. Else "".
std::string limit_of(const FreeParameter& p, double value);

/// A nonlinear parameter that the data do not determine, or that went to its lower bound without effect, as a warm-up
/// of a second, which is an offset; or amplitudes none of which differs significantly from zero, alone or together.
/// @param all intervals of the parameters of all terms @param lack_of_fit chi-square over its expectation
Unidentified identifiability_of(const ModelFit& fit, std::size_t term, std::span<const Interval> all,
                                double lack_of_fit);

}  // namespace tofgraph::diagnosis
