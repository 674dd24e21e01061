// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/selection.hpp"

#include "diagnosis/model/smooth_field_fit.hpp"
#include "diagnosis/search/maps.hpp"

#include <algorithm>
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

}  // namespace tofgraph::diagnosis
