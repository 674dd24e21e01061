// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/selection.hpp"

#include "diagnosis/search/maps.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
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

}  // namespace

std::optional<MapTrial> MapSearch::beside(const ModelFit& base) {
  return best_maps(task_.problem, base, task_.candidates, task_.refused, task_.options.seed);
}

std::optional<MapTrial> MapSearch::alone(const SelectedModel& selected, double enough) {
  const ModelFit given = selected.original_beside_best();
  std::optional<MapTrial> maps = beside(given);
  while (maps && maps->left > enough) {
    const ModelFit& fit = maps->trial.fit;
    std::optional<MapTrial> more = beside(linearised(task_.problem, fit));
    if (!more || !significant(more->trial.score) || task_.bic(fit) - task_.bic(more->trial.fit) < settings.min_bic_gain)
      break;
    maps = std::move(more);
  }
  if (maps && smooth_field_does_more(task_, given, maps->trial.fit)) return std::nullopt;
  if (maps) maps->trial.fit.state.linearisation = selected.best.state.linearisation;
  return maps;
}

std::optional<ModelFit> MapSearch::best(const SelectedModel& selected) {
  const ModelFit& best = selected.best;
  if (!task_.may_add(best)) return std::nullopt;
  task_.report_progress("looking for what each pixel does");
  std::optional<MapTrial> maps = beside(best);
  if (task_.added(best) > 0 && lack_of_fit(task_.problem, best) >= settings.explained) {
    std::optional<MapTrial> without = alone(selected, settings.explained);
    if (without && (!maps || task_.bic(without->trial.fit) < task_.bic(maps->trial.fit))) maps = std::move(without);
  }
  if (!maps) return std::nullopt;
  const ModelFit& fit = maps->trial.fit;
  const double bic_fall = task_.bic(best) - task_.bic(fit);
  const std::string why = !significant(maps->trial.score) || bic_fall < settings.min_bic_gain
                              ? "not worth its parameters, or chance may do as much"
                          : smooth_field_does_more(task_, best, fit)
                              ? "a residue that is new in each condition does more"
                              : "";
  task_.note({"maps",
              {maps->trial.candidate->name()},
              {{"gain", best.deviance - fit.deviance}, {"bic_fall", bic_fall}},
              why.empty() ? "worth it" : why});
  return why.empty() ? std::optional(std::move(maps->trial.fit)) : std::nullopt;
}

std::optional<ModelFit> MapSearch::in_place_of(const ModelFit& added, const SelectedModel& selected) {
  if (selected.best.state.nuisances.smooth_field) return std::nullopt;  // a lasting field looks like maps
  if (task_.added(added) == 0 || added.state.terms.back().maps) return std::nullopt;
  const double rest = lack_of_fit(task_.problem, added);
  if (rest < settings.explained) return std::nullopt;
  const double nearly_all = std::max(settings.explained, 1 + settings.map_max_excess * (rest - 1));
  std::optional<MapTrial> maps = alone(selected, nearly_all);
  if (!maps || maps->left > nearly_all || !significant(maps->trial.score) ||
      task_.bic(added) - task_.bic(maps->trial.fit) < settings.min_bic_gain)
    return std::nullopt;
  return std::move(maps->trial.fit);
}

namespace {

/// A parameter that adds the same to all distances, and the response per unit.
struct Constant {
  std::size_t term = 0, parameter = 0;
  double response = 0;
};

/// Value of a column that is equal in all known distances and changes nothing else; 0 for other columns.
double height_of(const Problem& problem, const Column& column) {
  constexpr double same = 1e-6;
  double first = 0;
  for (std::size_t i = 0; i < column.size(); ++i) {
    if (!problem.design.shows_board(i)) continue;
    for (std::size_t row = 0; row < column[i].size(); ++row) {
      if (std::isinf(problem.data[i].variance[row])) continue;
      const bool length = problem.is_of(distance, row);
      if (length && first == 0) first = column[i][row];
      const double expected = length ? first : 0;
      if (!(std::abs(column[i][row] - expected) <= same * std::max(std::abs(first), 1e-6))) return 0;
    }
  }
  return first;
}

std::optional<Constant> constant_of(const Problem& problem, const State& state) {
  const auto rows = expected(problem, state);
  for (std::size_t t = 0; t < state.terms.size(); ++t) {
    const Term& term = state.terms[t];
    for (std::size_t k = 0; !term.maps && k < term.values.size(); ++k) {
      const FreeParameter& p = term.candidate->free()[k];
      if (p.nonlinear) continue;
      const double height = height_of(problem, derivative(problem, state, rows, t, k));
      if (height != 0) return Constant{t, k, height / p.typical};
    }
  }
  return std::nullopt;
}

}  // namespace

State with_means_in_constant(const Problem& problem, State state) {
  if (!has_maps(state)) return state;
  const std::optional<Constant> constant = constant_of(problem, state);
  if (!constant) return state;
  const auto grid = static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(problem.design.superpixels()))));
  for (Term& term : state.terms) {
    if (!term.maps) continue;
    std::vector<EstimatedMaps::Map> maps = term.maps->maps();
    for (EstimatedMaps::Map& map : maps) {
      if (map.parameter.unit != "m") continue;
      const double mean = std::reduce(map.values.begin(), map.values.end()) / static_cast<double>(map.values.size());
      for (double& value : map.values) value -= mean;
      state.terms[constant->term].values[constant->parameter] += term.values.front() * mean / constant->response;
    }
    term.maps =
        std::make_shared<const EstimatedMaps>(std::move(maps), term.maps->dimension(), grid, problem.design.camera());
  }
  return state;
}

}  // namespace tofgraph::diagnosis
