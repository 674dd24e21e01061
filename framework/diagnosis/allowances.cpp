// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// What a selection allows its conditions to have of their own.
#include "diagnosis/places.hpp"
#include "diagnosis/selection.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tofgraph::diagnosis {

/// What would explain the rest though it is none of the camera's, with what it gains: boards that are not flat, or a
/// residue where there is one already.
std::pair<Allowances, double> Selection::allowance() {
  std::pair<Allowances, double> result{problem_.allowed, 0};
  if (left() < explained) return result;
  if (problem_.allowed.residue) {
    const ResidueTrial trial = residue_of(problem_, best_.fit);
    if (trial.residue) result = {{problem_.allowed.looseness, trial.residue, problem_.allowed.boards}, trial.gain};
  }
  if (!problem_.allowed.boards && problem_.design.superpixels() > 1) {
    if (!shapes_) shapes_ = std::make_unique<const BoardShapes>(problem_);
    const BoardTrial trial = shapes_->trial(problem_, best_.fit.state);
    if (trial.boards && trial.gain > result.second)
      result = {{problem_.allowed.looseness, problem_.allowed.residue, trial.boards}, trial.gain};
  }
  return result;
}

/// Where conditions have something of their own, a board that stands elsewhere or a residue that is smooth over the
/// image: what can be seen beside that. Asked when no effect helps any more, as each of these could be taken for one.
/// @returns whether there is such a thing that was not known before
bool Selection::look_at_conditions() {
  constexpr double as_before = 0.2;  // of a logarithm
  Allowances more = problem_.allowed;
  more.looseness = looseness_of(places_of(problem_, best_.fit.state));
  double most = 0;
  for (std::size_t i = 0; i < more.looseness.size(); ++i)
    most = std::max(most, std::abs(std::log(more.looseness[i] /
                                            (problem_.allowed.looseness.empty() ? 1 : problem_.allowed.looseness[i]))));
  ResidueTrial residue;
  if (problem_.allowed.residue || (pieces().empty() && left() >= explained)) residue = residue_of(problem_, best_.fit);
  if (most < as_before && !residue.residue) return false;
  if (residue.residue) more.residue = std::move(residue.residue);
  return allow(std::move(more));
}

/// @returns whether that could be: an effect may give no number where the fit goes then, and all stays as it was
bool Selection::allow(Allowances more) {
  say("allowing for what conditions have of their own");
  note({"allowed",
        {},
        {{"smooth_residue_m", more.residue ? more.residue->sd() : 0},
         {"boards_m", more.boards ? more.boards->sd : 0},
         {"loosest_board", more.looseness.empty() ? 1 : std::ranges::max(more.looseness)}},
        "effects are looked for again beside it"});
  std::swap(problem_.allowed, more);
  if (try_refine(best_.fit.state).empty()) {
    original_.fit = fit_with_maps(problem_, original_.fit.state, weight_);
    return true;
  }
  problem_.allowed = std::move(more);
  return false;
}

/// Shapes of boards are found with the model: anew for another one. @returns whether there are any
bool Selection::reshape_boards() {
  if (!problem_.allowed.boards) return false;
  problem_.allowed.boards = shapes_->trial(problem_, best_.fit.state).boards;
  return true;
}

}  // namespace tofgraph::diagnosis
