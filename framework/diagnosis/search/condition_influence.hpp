// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Influence of each condition of a campaign: its held-out gap, and its share in the gain of an effect.
#pragma once

#include "diagnosis/search/crossfit.hpp"

namespace tofgraph::diagnosis {

/// Root mean squares over a condition's superpixels and over the folds that put it aside, SI (of the distance as
/// depth). NaN where nothing is known.
struct ConditionGap {
  double before = 0, after = 0;
};
/// Gaps, one a condition. @param conditions of the whole design
std::vector<ConditionGap> gaps_by_condition(const CrossFit& cross_fit, std::size_t conditions, std::size_t observable);

/// Shares of the conditions in the deviance that an effect gains, sum 1: s_i b / sum(s_j b), with s_i what a condition
/// adds to the score of the effect's change and b the size that suits all of them. The other effects and the
/// reflectivities make up for what they can (linearly). A condition that speaks against the effect has a share below 0.
/// @param term of the state @returns one a condition; empty where the effect changes nothing
std::vector<double> influence(const Problem& problem, const State& state, std::size_t term);

/// Correlations of the fit's parameters, in the order of the terms' free parameters. 0 where a parameter has no
/// variance.
Eigen::MatrixXd correlations(const ModelFit& fit);

}  // namespace tofgraph::diagnosis
