// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Intervals of the parameters of a fit, and their identifiability.
#pragma once

#include "diagnosis/model/candidate.hpp"
#include "diagnosis/model/fit.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace tofgraph::diagnosis {

/// Assumption of intervals about refinements that were not fitted.
enum class Refinements {
  as_they_are,   ///< their amplitudes are off
  may_be_there,  ///< normal about off, one typical value as standard deviation: too small to detect is not zero
};
struct Interval {
  double low = 0, high = 0;
};
/// 95 % intervals of the free parameters of all terms, in SI: bootstrap over conditions, with one step of least squares
/// per draw. Never narrower than the fit's covariance implies.
/// @param lack_of_fit chi-square over its expectation; above 1, intervals are wider by its square root
/// @param refinements assumption about those that a term does not have
std::vector<Interval> intervals(const Problem& problem, const ModelFit& fit, std::uint64_t seed, double lack_of_fit,
                                Refinements refinements = Refinements::may_be_there);

enum class ParameterStatus {
  determined,
  consistent_with_zero,  ///< the interval of an amplitude contains off
  not_determined         ///< the interval is that of the prior, or the whole range
};

/// @param variance of the fit, in squared typical values; NaN: unknown, as for maps
ParameterStatus parameter_status(const FreeParameter& parameter, const Interval& interval, double variance);

// ---- Identifiability of an effect's values ----

/// Reason why the data do not determine the values of a term.
struct Unidentified {
  std::string why;                       ///< empty: they are determined
  std::optional<std::size_t> nonlinear;  ///< the parameter concerned: undetermined, or at its limit
  bool at_limit = false;                 ///< true: at its limit
};

/// Message for a nonlinear parameter practically at its minimum, if its range exceeds 10 typical values; else "".
/// Smaller ranges, such as none to all, may end at a meaningful value.
std::string limit_of(const FreeParameter& p, double value);

/// Reason why a term is unidentified: a nonlinear parameter that is undetermined or reached its lower limit (a warm-up
/// of one second, which is an offset), or amplitudes none of which differs significantly from zero, alone or together.
/// @param all intervals of the parameters of all terms @param lack_of_fit chi-square over its expectation
Unidentified identifiability_of(const ModelFit& fit, std::size_t term, std::span<const Interval> all,
                                double lack_of_fit);
/// The same with intervals of its own. @param fit including its jacobian @param seed of the intervals
Unidentified identifiability_of(const Problem& problem, const ModelFit& fit, std::size_t term, std::uint64_t seed);

}  // namespace tofgraph::diagnosis
