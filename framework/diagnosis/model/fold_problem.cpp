// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/fold_problem.hpp"

#include "diagnosis/model/another_contrast.hpp"

#include <algorithm>

namespace tofgraph::diagnosis {
namespace {

/// A problem whose targets are those of another one, in their order, then those that are new.
Problem problem_like(const Problem& other, const Design& design, const std::vector<Observations>& data) {
  Problem problem{design, data, other.targets, {}, nuisances_of(design, has_contrast(other.nuisances)), other.deadline};
  for (const io::Condition& condition : design.conditions()) {
    auto found = std::ranges::find(problem.targets, condition.target);
    const bool known = is_light_known(condition);
    if (!known && found == problem.targets.end() && problem.light_seen())
      found = problem.targets.insert(found, condition.target);
    problem.target.push_back(
        known || found == problem.targets.end() ? -1 : static_cast<int>(found - problem.targets.begin()));
  }
  return problem;
}

std::vector<Observations> picked(const std::vector<Observations>& all, const std::vector<std::size_t>& chosen) {
  std::vector<Observations> some;
  for (const std::size_t i : chosen) some.push_back(all[i]);
  return some;
}

}  // namespace

FoldProblem::FoldProblem(const Design& whole, const std::vector<Observations>& all,
                         const std::vector<std::size_t>& chosen, const Deadline* deadline)
    : design(whole.part(chosen)), data(picked(all, chosen)), problem(make_problem(design, data, deadline)) {}

FoldProblem::FoldProblem(const Design& whole, const std::vector<Observations>& all,
                         const std::vector<std::size_t>& chosen, const FoldProblem& other)
    : design(whole.part(chosen)), data(picked(all, chosen)), problem(problem_like(other.problem, design, data)) {}

void FoldProblem::fix_contrast(double log_lower) {
  const std::size_t n = design.superpixels();
  for (std::size_t i = 0; i < data.size(); ++i) {
    for (std::size_t row = intensity * n; design.shows_board(i) && row < (intensity + 1) * n; ++row)
      data[i].value[row] -= log_lower;
  }
  problem.nuisances = nuisances_of(design);
}

}  // namespace tofgraph::diagnosis
