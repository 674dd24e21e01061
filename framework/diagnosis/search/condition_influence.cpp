// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/condition_influence.hpp"

#include <cmath>

namespace tofgraph::diagnosis {

std::vector<ConditionGap> gaps_by_condition(const CrossFit& cross_fit, std::size_t conditions, std::size_t observable) {
  std::vector<ConditionGap> sums(conditions);
  std::vector<double> count(conditions, 0);
  for (const FoldResult& fold : cross_fit.folds) {
    for (const OutOfFold& c : fold.conditions) {
      sums[c.condition].before += c.before[observable];
      sums[c.condition].after += c.after[observable];
      count[c.condition] += c.count[observable];
    }
  }
  for (std::size_t i = 0; i < conditions; ++i) {
    const auto root = [&](double sum) { return count[i] > 0 ? std::sqrt(sum / count[i]) : NAN; };
    sums[i] = {root(sums[i].before), root(sums[i].after)};
  }
  return sums;
}

std::vector<double> influence(const Problem& problem, const State& state, std::size_t term) {
  ModelFit without;
  without.state = state;
  without.state.terms.erase(without.state.terms.begin() + static_cast<std::ptrdiff_t>(term));
  const auto rows = expected(problem, without.state);
  without.jacobian = jacobian(problem, without.state, rows);
  const Group change{state.terms[term].candidate->name(), {difference(expected(problem, state), rows)}};
  const Score score = score_of(problem, without, change, 0, 0);
  if (!(score.gain > 0)) return {};
  const auto conditions = static_cast<Eigen::Index>(problem.data.size());  // what these share at random comes after
  const Eigen::VectorXd shares = score.shares.topRows(conditions) * score.values;
  const double all = shares.sum();
  if (!(all > 0)) return {};
  std::vector<double> result;
  for (const double share : shares) result.push_back(share / all);
  return result;
}

Eigen::MatrixXd correlations(const ModelFit& fit) {
  Eigen::Index count = 0;
  for (const Term& term : fit.state.terms) count += static_cast<Eigen::Index>(term.values.size());
  const Eigen::MatrixXd covariance = fit.covariance.topLeftCorner(count, count);
  const Eigen::VectorXd sd = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const Eigen::VectorXd scale = (sd.array() > 0).select(sd.cwiseInverse(), 0);
  return scale.asDiagonal() * covariance * scale.asDiagonal();
}

}  // namespace tofgraph::diagnosis
