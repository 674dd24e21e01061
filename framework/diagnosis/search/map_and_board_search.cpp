// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/selection.hpp"

#include "diagnosis/model/smooth_field.hpp"
#include "diagnosis/search/maps.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// True if a smooth field gains more than maps: a field that differs between conditions has a mean over the conditions,
/// which looks like maps.
bool smooth_field_does_more(const SelectionTask& task, const ModelFit& base, const ModelFit& maps) {
  return !base.state.nuisances.smooth_field &&
         smooth_field_of(task.problem, base).gain > task.bic(base) - task.bic(maps);
}

/// Calls f(parameter, value) for the values that can be extrapolated: neither maps nor angles, which are periodic.
/// @param state const or not; the values are accordingly
template <class S, class F> void for_each_steady(S& state, F f) {
  for (auto& term : state.terms) {
    for (std::size_t k = 0; !term.maps && k < term.values.size(); ++k) {
      if (!term.candidate->free()[k].is_angle()) f(term.candidate->free()[k], term.values[k]);
    }
  }
}

/// Values in typical values.
Eigen::VectorXd steady_values(const State& state) {
  std::vector<double> values;
  for_each_steady(state, [&](const FreeParameter& p, double value) { values.push_back(value / std::abs(p.typical)); });
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

State with_steady_values(State state, const Eigen::VectorXd& values) {
  Eigen::Index at = 0;
  for_each_steady(state, [&](const FreeParameter& p, double& value) {
    value = std::clamp(values(at++) * std::abs(p.typical), p.minimum, p.maximum);
  });
  return state;
}

/// Deviance of a model including the cost of its board heights: their prior and determinant.
double deviance_with_boards(const ModelFit& fit) {
  return fit.deviance + (fit.state.nuisances.boards ? fit.state.nuisances.boards->cost : 0);
}

}  // namespace

std::optional<MapTrial> MapSearch::best_added_to(const ModelFit& base) {
  return best_maps(task_.problem, base, task_.candidates, task_.refused, task_.options.seed);
}

std::optional<MapTrial> MapSearch::alone(const SelectedModel& selected, double enough) {
  const ModelFit given = selected.given_comparable_with_best();
  std::optional<MapTrial> maps = best_added_to(given);
  while (maps && maps->lack_of_fit > enough) {
    const ModelFit& fit = maps->fit;
    std::optional<MapTrial> more = best_added_to(with_jacobian(task_.problem, fit));
    if (!more || !significant(more->score) || task_.bic(fit) - task_.bic(more->fit) < settings.min_bic_gain) break;
    maps = std::move(more);
  }
  if (maps && smooth_field_does_more(task_, given, maps->fit)) return std::nullopt;
  if (maps) maps->fit.state.precomputed = selected.best.state.precomputed;
  return maps;
}

std::optional<ModelFit> MapSearch::best(const SelectedModel& selected) {
  const ModelFit& best = selected.best;
  if (!task_.may_add(best)) return std::nullopt;
  task_.report_progress("looking for what each pixel does");
  std::optional<MapTrial> maps = best_added_to(best);
  if (task_.added(best) > 0 && lack_of_fit(task_.problem, best) >= settings.explained) {
    std::optional<MapTrial> without = alone(selected, settings.explained);
    if (without && (!maps || task_.bic(without->fit) < task_.bic(maps->fit))) maps = std::move(without);
  }
  if (!maps) return std::nullopt;
  const ModelFit& fit = maps->fit;
  const double bic_fall = task_.bic(best) - task_.bic(fit);
  const std::string why = !significant(maps->score) || bic_fall < settings.min_bic_gain
                              ? "not worth its parameters, or chance may do as much"
                          : smooth_field_does_more(task_, best, fit)
                              ? "a residue that is new in each condition does more"
                              : "";
  task_.note({"maps",
              {maps->candidate->name()},
              {{"gain", best.deviance - fit.deviance}, {"bic_fall", bic_fall}},
              why.empty() ? "worth it" : why});
  return why.empty() ? std::optional(std::move(maps->fit)) : std::nullopt;
}

std::optional<ModelFit> MapSearch::in_place_of(const ModelFit& added, const SelectedModel& selected) {
  if (selected.best.state.nuisances.smooth_field) return std::nullopt;  // a lasting field looks like maps
  if (task_.added(added) == 0 || added.state.terms.back().maps) return std::nullopt;
  const double rest = lack_of_fit(task_.problem, added);
  if (rest < settings.explained) return std::nullopt;
  const double nearly_all = std::max(settings.explained, 1 + settings.map_max_excess * (rest - 1));
  std::optional<MapTrial> maps = alone(selected, nearly_all);
  if (!maps || maps->lack_of_fit > nearly_all || !significant(maps->score) ||
      task_.bic(added) - task_.bic(maps->fit) < settings.min_bic_gain)
    return std::nullopt;
  return std::move(maps->fit);
}

BoardTrial BoardFlatnessSearch::trial_for(const State& state) {
  if (state.nuisances.boards || task_.problem.design.superpixels() < 2) return {};
  if (!shapes_) shapes_ = std::make_unique<const BoardFlatness>(task_.problem);
  return shapes_->trial(task_.problem, state);
}

/// Fits boards and effects once. @returns true if there are boards, and both together fit better
bool BoardFlatnessSearch::refit_once(ModelFit& fit, bool unsure) const {
  const double before = deviance_with_boards(fit);
  if (!fit.state.nuisances.boards) return false;
  BoardTrial boards = shapes_->trial(task_.problem, fit.state);
  fit.state.nuisances.boards = boards.sure || unsure ? std::move(boards.boards) : nullptr;
  fit = with_jacobian(task_.problem, fit_with_maps(task_.problem, fit.state));
  return before - deviance_with_boards(fit) >= settings.board_converged;
}

/// Boards and effects with similar signatures would converge slowly: after two steps the values are extrapolated from
/// the difference of the steps (SQUAREM, R. Varadhan and C. Roland, Scandinavian Journal of Statistics 35, 2008, scheme
/// S3), and restored if the extrapolation went too far.
ModelFit BoardFlatnessSearch::refit(ModelFit fit, bool unsure) const {
  for (int round = 0; round < settings.board_max_rounds; ++round) {
    const Eigen::VectorXd start = steady_values(fit.state);
    if (!refit_once(fit, unsure)) return fit;
    const Eigen::VectorXd first = steady_values(fit.state);
    if (!refit_once(fit, unsure)) return fit;
    const Eigen::VectorXd second = steady_values(fit.state), step = first - start, bend = second - first - step;
    if (!(bend.norm() > 0) || !(step.norm() > bend.norm())) continue;  // converges without extrapolation
    const double length = step.norm() / bend.norm();
    ModelFit farther = fit;
    try {
      farther.state = with_steady_values(fit.state, start + 2 * length * step + length * length * bend);
      refit_once(farther, unsure);
      if (deviance_with_boards(farther) <= deviance_with_boards(fit)) fit = std::move(farther);
    } catch (const simulation::EffectError&) {  // too far: the fit is kept
    }
  }
  return fit;
}

}  // namespace tofgraph::diagnosis
