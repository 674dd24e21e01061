// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file How large the gap is, and how sure the parameters are.
#pragma once

#include "diagnosis/fit.hpp"

#include <cstdint>

namespace tofgraph::diagnosis {

/// Root mean square of measurement minus simulation over superpixels, SI; NaN where nothing is known.
/// For the distance it is that of the depth.
double gap(const Problem& problem, const State& state, std::size_t observable);

/// What noise, and the jitter of board, camera and light, alone would leave of gap().
double noise_floor(const Problem& problem, const State& state, std::size_t observable);

struct Interval {
  double low = 0, high = 0;
};
/// 95 % intervals of the free parameters of all terms, in SI: conditions are drawn with replacement, each draw is one
/// step of least squares. Never narrower than the covariance of the fit says.
std::vector<Interval> intervals(const Problem& problem, const Fit& fit, std::uint64_t seed);

}  // namespace tofgraph::diagnosis
