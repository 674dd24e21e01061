// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file How well a model does on conditions that it was not fitted to, and how sure its parameters are.
#pragma once

#include "diagnosis/fit.hpp"

#include <cstdint>

namespace tofgraph::diagnosis {

/// Whole levels of distance, integration time and target are put aside: a quarter of the conditions, and more where
/// settings have few levels, but for those without which too few would be left for a fit.
/// @returns for each condition whether it is held out; none where no setting has four levels
std::vector<bool> hold_out(const Design& design, std::uint64_t seed);

/// Root mean square of measurement minus simulation over superpixels, SI; NaN where nothing is known.
/// For the distance it is that of the depth.
/// @param chosen conditions that count
double gap(const Problem& problem, const State& state, std::size_t observable, const std::vector<bool>& chosen);

/// What noise, and the jitter of board, camera and light, alone would leave of gap().
double noise_floor(const Problem& problem, const State& state, std::size_t observable, const std::vector<bool>& chosen);

struct Interval {
  double low = 0, high = 0;
};
/// 95 % intervals of the free parameters of all terms, in SI: conditions are drawn with replacement, each draw is one
/// step of least squares. Never narrower than the covariance of the fit says.
std::vector<Interval> intervals(const Problem& problem, const Fit& fit, std::uint64_t seed);

}  // namespace tofgraph::diagnosis
