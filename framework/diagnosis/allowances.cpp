// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// What a selection allows its conditions to have of their own.
#include "diagnosis/places.hpp"
#include "diagnosis/selection.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

constexpr int most_turns = 12;    ///< of boards and effects, two rounds each and one that goes on as they went
constexpr double hardly = 1;      ///< fall of the deviance
constexpr double at_least = 0.8;  ///< of what the shape of a board explains: what sets must promise in its place

/// Calls f(parameter, value) for what goes on as it went: neither maps nor angles, which have no end to go to.
/// @param state const or not, as the values then are
template <class S, class F> void for_each_steady(S& state, F f) {
  for (auto& term : state.terms) {
    for (std::size_t k = 0; !term.maps && k < term.values.size(); ++k) {
      if (!term.candidate->free()[k].is_angle()) f(term.candidate->free()[k], term.values[k]);
    }
  }
}

/// In typical sizes.
Eigen::VectorXd values_of(const State& state) {
  std::vector<double> values;
  for_each_steady(state, [&](const FreeParameter& p, double value) { values.push_back(value / std::abs(p.typical)); });
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

State with_values(State state, const Eigen::VectorXd& values) {
  Eigen::Index at = 0;
  for_each_steady(state, [&](const FreeParameter& p, double& value) {
    value = std::clamp(values(at++) * std::abs(p.typical), p.minimum, p.maximum);
  });
  return state;
}

}  // namespace

/// An effect that has a part in the shapes of boards takes that back when they are found anew beside it.
/// @returns whether there are any then
bool Selection::allow_boards(std::shared_ptr<const Boards> boards) {
  Allowances more = problem_.allowed;
  more.boards = std::move(boards);
  return allow(std::move(more)) && problem_.allowed.boards;
}

/// Nothing where they are known already, or are not worth it.
BoardTrial Selection::boards_beside(const State& state) {
  if (problem_.allowed.boards || problem_.design.superpixels() < 2) return {};
  if (!shapes_) shapes_ = std::make_unique<const BoardShapes>(problem_);
  return shapes_->trial(problem_, state);
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
  if (residue.residue) more.residue = std::move(residue.residue), more.runs = std::move(residue.runs);
  return allow(std::move(more));
}

/// @returns whether that could be: an effect may give no number where the fit goes then, and all stays as it was
bool Selection::allow(Allowances more) {
  say("allowing for what conditions have of their own");
  Kept before = kept();
  Step step{"allowed",
            {},
            {{"smooth_residue_m", more.residue ? more.residue->sd() : 0},
             {"boards_m", more.boards ? more.boards->sd : 0},
             {"loosest_board", more.looseness.empty() ? 1 : std::ranges::max(more.looseness)}},
            "effects are looked for again beside it"};
  problem_.allowed = std::move(more);
  bool could = true;
  try {
    refine(best_.fit.state);
    const InLightOf there(problem_, original_);
    original_.fit = fit_with_maps(problem_, original_.fit.state, weight_);
  } catch (const simulation::EffectError& error) {
    restore(std::move(before));
    step.outcome = error.what();
    could = false;
  }
  note(std::move(step));
  return could;
}

/// Shapes of boards are found with the model: anew for another one. @returns whether there were any
bool Selection::reshape_boards() {
  if (!problem_.allowed.boards) return false;
  BoardTrial boards = shapes_->trial(problem_, best_.fit.state);
  problem_.allowed.boards = boards.sure || any_boards_ ? std::move(boards.boards) : nullptr;
  return true;
}

/// What a model and its boards explain together: shapes cost the deviance what being any shape is worth.
double Selection::deviance_beside_boards() const {
  return best_.fit.deviance + (problem_.allowed.boards ? problem_.allowed.boards->cost : 0);
}

/// One round of boards and effects. @returns whether there are boards, and both together fit better
bool Selection::fit_beside_boards() {
  const double before = deviance_beside_boards();
  if (!reshape_boards()) return false;
  take(fit_with_maps(problem_, best_.fit.state, weight_));
  return before - deviance_beside_boards() >= hardly;
}

/// Boards and effects that look alike would take from each other in small steps for ever: after two of these the values
/// go on as the two differ (SQUAREM, R. Varadhan and C. Roland, Scandinavian Journal of Statistics 35, 2008, scheme
/// S3), and come back where they went too far.
/// @throws simulation::EffectError, but where the values went too far
void Selection::settle_boards() {
  for (int turn = 0; turn < most_turns; ++turn) {
    const Eigen::VectorXd start = values_of(best_.fit.state);
    if (!fit_beside_boards()) return;
    const Eigen::VectorXd first = values_of(best_.fit.state);
    if (!fit_beside_boards()) return;
    const Eigen::VectorXd second = values_of(best_.fit.state), step = first - start, bend = second - first - step;
    if (!(bend.norm() > 0) || !(step.norm() > bend.norm())) continue;  // it comes to an end by itself
    const double length = step.norm() / bend.norm();
    Kept before = kept();
    const double reached = deviance_beside_boards();
    try {
      best_.fit.state = with_values(before.best.fit.state, start + 2 * length * step + length * length * bend);
      fit_beside_boards();
      if (deviance_beside_boards() > reached) restore(std::move(before));
    } catch (const simulation::EffectError&) {
      restore(std::move(before));
    }
  }
}

/// The search begun with shapes of boards that may be the camera's: of one target alone, or beside effects, which would
/// make up for them otherwise. That has to lead to where nothing is left, and no effects, nor maps, may lead there
/// alone.
void Selection::grow_from_boards() {
  const BoardTrial boards = left() < explained ? BoardTrial{} : boards_beside(best_.fit.state);
  if (!boards.boards || boards.sure) return;
  if (const std::optional<Fit> next = leap(at_least * boards.gain);
      next && left_of(problem_, *next, own_columns(problem_, next->state, expected(problem_, next->state))) < explained)
    return;
  if (const std::optional<MapTrial> maps = maps_alone(explained); maps && maps->left < explained) return;
  Kept before = kept();
  any_boards_ = true;
  if (allow_boards(boards.boards)) add_all();
  any_boards_ = problem_.allowed.boards && left() < explained;
  if (!any_boards_) restore(std::move(before));
}

}  // namespace tofgraph::diagnosis
