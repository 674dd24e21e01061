// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Distance of two models in conditions, after their values have made up for what they can.
#pragma once

#include "diagnosis/search/next_condition.hpp"

namespace tofgraph::diagnosis {

/// Information of the campaign on the values of a state's effects, in steps of their typical values, and on the
/// targets' ln reflectivities: an information matrix. Empty where an effect gives no derivative.
Eigen::MatrixXd information_matrix(const Problem& problem, const State& state);

/// Distance of two models in each of a problem's conditions.
struct ModelDistance {
  std::vector<double> sigma;
  Column left;  ///< of the difference, when the values have made up for what they can
};

/// The first model of a question in the conditions of a problem: the same for all questions that begin with it.
struct QuestionLinearisation {
  State one;                    ///< without grid bias, with the nuisances of these conditions
  Column rows;                  ///< that it expects
  std::vector<Column> columns;  ///< of its values and of the targets' light; none where the campaign determines nothing
};
/// @throws simulation::EffectError
QuestionLinearisation linearise_question(const Problem& problem, const Question& question,
                                         const ConditionNuisances& nuisances);

/// Returns true when two questions begin with the same model.
bool begin_alike(const Question& first, const Question& second);

/// Distance of the two models, whichever is right: of each condition the one that the other comes nearer to.
/// @throws simulation::EffectError
ModelDistance model_distance(const Problem& problem, const QuestionLinearisation& first, const Question& question);

}  // namespace tofgraph::diagnosis
