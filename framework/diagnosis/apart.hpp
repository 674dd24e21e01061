// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file How far two models are apart in conditions, when their values have made up for what they can.
#pragma once

#include "diagnosis/next_condition.hpp"

namespace tofgraph::diagnosis {

/// What the campaign tells of the values of a state's effects, in steps of their typical values, and of the targets' ln
/// reflectivities: an information matrix. Empty where an effect gives no derivative.
Eigen::MatrixXd told_of_values(const Problem& problem, const State& state);

/// How far two models are apart in each of a problem's conditions.
struct Apart {
  std::vector<double> sigma;
  Column left;  ///< of the difference, when the values have made up for what they can
};

/// Whichever of the two is right: of each condition the one that the other comes nearer to.
/// @throws simulation::EffectError
Apart apart(const Problem& problem, const Question& question);

}  // namespace tofgraph::diagnosis
