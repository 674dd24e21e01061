// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// What a selection allows its conditions to have of their own.
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/board_offsets.hpp"
#include "diagnosis/search/selection.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

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
  ConditionNuisances more = best_.state.nuisances;
  more.boards = std::move(boards);
  return allow(std::move(more)) && best_.state.nuisances.boards;
}

/// Nothing where they are known already, or are not worth it.
BoardTrial Selection::boards_beside(const State& state) {
  if (best_.state.nuisances.boards || problem_.design.superpixels() < 2) return {};
  if (!shapes_) shapes_ = std::make_unique<const BoardFlatness>(problem_);
  return shapes_->trial(problem_, state);
}

/// Looks for nuisances of conditions, a board that stands elsewhere or a residual that is smooth over the
/// image: what can be seen beside that. Asked when no effect helps any more, as each of these could be taken for one.
/// @returns whether there is such a thing that was not known before
bool Selection::update_nuisances() {
  ConditionNuisances more = best_.state.nuisances;
  more.jitter_scale = jitter_scale_of(board_offsets_of(problem_, best_.state));
  double most = 0;
  for (std::size_t i = 0; i < more.jitter_scale.size(); ++i)
    most = std::max(most, std::abs(std::log(more.jitter_scale[i] / (best_.state.nuisances.jitter_scale.empty()
                                                                        ? 1
                                                                        : best_.state.nuisances.jitter_scale[i]))));
  SmoothFieldTrial smooth_field;
  if (best_.state.nuisances.smooth_field || (pieces().empty() && left() >= settings.explained))
    smooth_field = smooth_field_of(problem_, best_);
  if (most < settings.jitter_scale_change && !smooth_field.smooth_field) return false;
  if (smooth_field.smooth_field)
    more.smooth_field = std::move(smooth_field.smooth_field), more.runs = std::move(smooth_field.runs);
  return allow(std::move(more));
}

/// @returns whether that could be: an effect may give no number where the fit goes then, and all stays as it was
bool Selection::allow(ConditionNuisances more) {
  report_progress("allowing for what conditions have of their own");
  Kept before = kept();
  Step step{"allowed",
            {},
            {{"smooth_residue_m", more.smooth_field ? more.smooth_field->sd() : 0},
             {"boards_m", more.boards ? more.boards->sd : 0},
             {"loosest_board", more.jitter_scale.empty() ? 1 : std::ranges::max(more.jitter_scale)}},
            "effects are looked for again beside it"};
  bool could = true;
  try {
    State with = best_.state;
    with.nuisances = std::move(more);
    refine(std::move(with));
    ModelFit given = original_beside_best();
    given = fit_with_maps(problem_, std::move(given.state), weight_);
    given.jacobian = std::move(original_.jacobian);
    original_ = std::move(given);
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
  if (!best_.state.nuisances.boards) return false;
  BoardTrial boards = shapes_->trial(problem_, best_.state);
  best_.state.nuisances.boards = boards.sure || any_boards_ ? std::move(boards.boards) : nullptr;
  return true;
}

/// Deviance of a model together with its boards: shapes cost the deviance what being any shape is worth.
double Selection::deviance_beside_boards() const {
  return best_.deviance + (best_.state.nuisances.boards ? best_.state.nuisances.boards->cost : 0);
}

/// Fits boards and effects once. @returns whether there are boards, and both together fit better
bool Selection::fit_beside_boards() {
  const double before = deviance_beside_boards();
  if (!reshape_boards()) return false;
  accept(fit_with_maps(problem_, best_.state, weight_));
  return before - deviance_beside_boards() >= settings.board_converged;
}

/// Boards and effects that look alike would take from each other in small steps for ever: after two of these the values
/// go on as the two differ (SQUAREM, R. Varadhan and C. Roland, Scandinavian Journal of Statistics 35, 2008, scheme
/// S3), and come back where they went too far.
/// @throws simulation::EffectError, but where the values went too far
void Selection::fit_boards() {
  for (int turn = 0; turn < settings.board_max_rounds; ++turn) {
    const Eigen::VectorXd start = values_of(best_.state);
    if (!fit_beside_boards()) return;
    const Eigen::VectorXd first = values_of(best_.state);
    if (!fit_beside_boards()) return;
    const Eigen::VectorXd second = values_of(best_.state), step = first - start, bend = second - first - step;
    if (!(bend.norm() > 0) || !(step.norm() > bend.norm())) continue;  // it comes to an end by itself
    const double length = step.norm() / bend.norm();
    Kept before = kept();
    const double reached = deviance_beside_boards();
    try {
      best_.state = with_values(before.best.state, start + 2 * length * step + length * length * bend);
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
void Selection::select_from_boards() {
  const BoardTrial boards = left() < settings.explained ? BoardTrial{} : boards_beside(best_.state);
  if (!boards.boards || boards.sure) return;
  if (const std::optional<ModelFit> next = search_subsets(settings.board_min_subset_promise * boards.gain);
      next && lack_of_fit(problem_, linearised(problem_, *next)) < settings.explained)
    return;
  if (const std::optional<MapTrial> maps = maps_alone(settings.explained); maps && maps->left < settings.explained)
    return;
  Kept before = kept();
  any_boards_ = true;
  if (allow_boards(boards.boards)) add_all();
  any_boards_ = best_.state.nuisances.boards && left() < settings.explained;
  if (!any_boards_) restore(std::move(before));
}

}  // namespace tofgraph::diagnosis
