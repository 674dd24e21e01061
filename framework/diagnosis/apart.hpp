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

/// Conditions in the light of the first model of a question: what is the same for all questions that begin with it.
struct InLightOfOne {
  Problem problem;              ///< without correction, brightened by the model
  Column rows;                  ///< that the model expects
  std::vector<Column> columns;  ///< of its values and of the targets' light; none where the campaign tells nothing
};
/// @throws simulation::EffectError
InLightOfOne in_light_of_one(const Problem& problem, const Question& question);

/// Returns true when two questions begin with the same model.
bool begin_alike(const Question& first, const Question& second);

/// Whichever of the two is right: of each condition the one that the other comes nearer to.
/// @throws simulation::EffectError
Apart apart(const InLightOfOne& lit, const Question& question);

}  // namespace tofgraph::diagnosis
