// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Intervals of the parameters of a fit.
#pragma once

#include "diagnosis/model/fit.hpp"

#include <cstdint>

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

}  // namespace tofgraph::diagnosis
