// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Effects with a number for every pixel in a selection: they come last, and may take the place of others.
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/search/selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

namespace tofgraph::diagnosis {
namespace {}  // namespace

std::optional<MapTrial> Selection::maps_on(const ModelFit& base) {
  return best_maps(problem_, base, candidates_, refused_, weight_, options_.flips, options_.seed);
}

/// True if a smooth field gains more than maps: a field that is new in each condition has a mean over the conditions,
/// which looks like maps.
bool Selection::smooth_field_does_more(const ModelFit& base, const ModelFit& maps) const {
  return !base.state.nuisances.smooth_field && smooth_field_of(problem_, base).gain > bic(base) - bic(maps);
}

/// In the place of all that was found: those of one effect, and beside them those of others while these are worth it
/// and more than enough is left.
std::optional<MapTrial> Selection::maps_alone(double enough) {
  const ModelFit given = original_beside_best();
  std::optional<MapTrial> maps = maps_on(given);
  while (maps && maps->left > enough) {
    const ModelFit& fit = maps->trial.fit;
    std::optional<MapTrial> more = maps_on(linearised(problem_, fit));
    if (!more || !significant(more->trial.score) || bic(fit) - bic(more->trial.fit) < settings.min_bic_gain) break;
    maps = std::move(more);
  }
  if (maps && smooth_field_does_more(given, maps->trial.fit)) return std::nullopt;
  if (maps) maps->trial.fit.state.linearisation = best_.state.linearisation;
  return maps;
}

/// When no effect with a few parameters helps any more: one with a number for every pixel, beside what was found or in
/// its place.
std::optional<ModelFit> Selection::good_maps() {
  if (terms().size() >= model_.size() + options_.max_effects) return std::nullopt;
  report_progress("looking for what each pixel does");
  std::optional<MapTrial> maps = maps_on(best_);
  if (terms().size() > model_.size() && left() >= settings.explained) {
    std::optional<MapTrial> alone = maps_alone(settings.explained);
    if (alone && (!maps || bic(alone->trial.fit) < bic(maps->trial.fit))) maps = std::move(alone);
  }
  if (!maps) return std::nullopt;
  const ModelFit& fit = maps->trial.fit;
  const std::string why = !significant(maps->trial.score) || bic(best_) - bic(fit) < settings.min_bic_gain
                              ? "not worth its parameters, or chance may do as much"
                          : smooth_field_does_more(best_, fit) ? "a residue that is new in each condition does more"
                                                               : "";
  note({"maps",
        {maps->trial.candidate->name()},
        {{"gain", best_.deviance - fit.deviance}, {"bic_fall", bic(best_) - bic(fit)}},
        why.empty() ? "worth it" : why});
  return why.empty() ? std::optional(std::move(maps->trial.fit)) : std::nullopt;
}

/// Maps alone where they explain all there is beside the model as it was, or nearly, and what was added to it does not:
/// that stands for a part of them.
std::optional<ModelFit> Selection::maps_instead(const ModelFit& added) {
  if (best_.state.nuisances.smooth_field) return std::nullopt;  // what is the same each time would look like maps
  if (added.state.terms.size() == model_.size() || added.state.terms.back().maps) return std::nullopt;
  const double rest = lack_of_fit(problem_, added);
  if (rest < settings.explained) return std::nullopt;
  const double nearly_all = std::max(settings.explained, 1 + settings.map_max_excess * (rest - 1));
  std::optional<MapTrial> alone = maps_alone(nearly_all);
  if (!alone || alone->left > nearly_all || !significant(alone->trial.score) ||
      bic(added) - bic(alone->trial.fit) < settings.min_bic_gain)
    return std::nullopt;
  return std::move(alone->trial.fit);
}

/// Repeats the search, begun with maps, if a residual is unexplained. Other effects may have taken the place of one
/// that was hidden behind them.
void Selection::select_from_maps() {
  if (best_.state.nuisances.smooth_field || terms().size() == model_.size() || left() < settings.explained) return;
  const double gained = bic(original_) - bic(best_);
  std::optional<MapTrial> alone = maps_alone(settings.explained);
  if (!alone || !significant(alone->trial.score) ||
      bic(original_) - bic(alone->trial.fit) < settings.map_start_share * gained)
    return;
  Kept before = kept();
  const double reached = bic(best_);
  if (!try_refine(std::move(alone->trial.fit.state))) return;
  add_all();
  // With other boards there is no comparison.
  if (bic(best_) > reached ||
      (best_.state.nuisances.boards == nullptr) != (before.best.state.nuisances.boards == nullptr))
    restore(std::move(before));
}

/// If several effects with maps were added, searches for effects with a few parameters in the place of one of
/// them. A map can do what a lens does to the amplitude, at the price of all its numbers. With boards that are not flat
/// there is no comparison.
void Selection::replace_maps() {
  std::vector<const Candidate*> with_maps;
  for (std::size_t t = model_.size(); t < terms().size(); ++t) {
    if (terms()[t].maps) with_maps.push_back(terms()[t].candidate);
  }
  if (best_.state.nuisances.smooth_field || best_.state.nuisances.boards || with_maps.size() < 2) return;
  for (const Candidate* one : with_maps) {
    Kept before = kept();
    bool better = false;
    try {
      better = reselect_without(*one, settings.map_replacement_promise, -settings.min_bic_gain);
    } catch (const simulation::EffectError&) {  // without it the others give no number
    }
    note({"maps", {one->name()}, {}, better ? "others do more in its place" : "stays"});
    if (better) return;
    restore(std::move(before));
  }
}

}  // namespace tofgraph::diagnosis
