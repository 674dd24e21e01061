// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Effects with a number for every pixel in a selection: they come last, and may take the place of others.
#include "diagnosis/selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

constexpr double promising_maps = 0.3;  ///< of all that was gained: what maps alone must gain to begin with them
constexpr double in_its_place = 0.75;   ///< of what a map gains: what sets of effects must promise to be tried instead
constexpr double hardly_any = 0.01;     ///< of what other effects leave: what maps leave that are taken in their place

}  // namespace

std::optional<MapTrial> Selection::maps_on(const Base& base) {
  return best_maps(problem_, base, candidates_, refused_, weight_, options_.flips, options_.seed);
}

/// What is smooth over the image and new in each condition has a mean over the conditions, which looks like maps.
bool Selection::residue_does_more(const Base& base, const Fit& maps) const {
  return !problem_.allowed.residue && residue_of(problem_, base.fit).gain > bic(base.fit) - bic(maps);
}

/// In the place of all that was found: those of one effect, and beside them those of others while these are worth it
/// and more than enough is left.
std::optional<MapTrial> Selection::maps_alone(double enough) {
  const InLightOf there(problem_, original_);
  std::optional<MapTrial> maps = maps_on(original_);
  while (maps && maps->left > enough) {
    const Fit& fit = maps->trial.fit;
    std::optional<MapTrial> more =
        maps_on({fit, own_columns(problem_, fit.state, expected(problem_, fit.state)), original_.brightening});
    if (!more || !significant(more->trial.score) || bic(fit) - bic(more->trial.fit) < worth) break;
    maps = std::move(more);
  }
  if (maps && residue_does_more(original_, maps->trial.fit)) return std::nullopt;
  return maps;
}

/// When no effect with a few parameters helps any more: one with a number for every pixel, beside what was found or in
/// its place.
std::optional<Fit> Selection::good_maps() {
  if (terms().size() >= model_.size() + options_.max_effects) return std::nullopt;
  say("looking for what each pixel does");
  std::optional<MapTrial> maps = maps_on(best_);
  if (terms().size() > model_.size() && left() >= explained) {
    std::optional<MapTrial> alone = maps_alone(explained);
    if (alone && (!maps || bic(alone->trial.fit) < bic(maps->trial.fit))) maps = std::move(alone);
  }
  if (!maps) return std::nullopt;
  const Fit& fit = maps->trial.fit;
  const std::string why = !significant(maps->trial.score) || bic(best_.fit) - bic(fit) < worth
                              ? "not worth its parameters, or chance may do as much"
                          : residue_does_more(best_, fit) ? "a residue that is new in each condition does more"
                                                          : "";
  note({"maps",
        {maps->trial.candidate->name()},
        {{"gain", best_.fit.deviance - fit.deviance}, {"bic_fall", bic(best_.fit) - bic(fit)}},
        why.empty() ? "worth it" : why});
  return why.empty() ? std::optional(std::move(maps->trial.fit)) : std::nullopt;
}

/// Maps alone where they explain all there is beside the model as it was, or nearly, and what was added to it does not:
/// that stands for a part of them.
std::optional<Fit> Selection::maps_instead(const Fit& added, std::span<const Column> own) {
  if (problem_.allowed.residue) return std::nullopt;  // what is the same each time would look like maps
  if (added.state.terms.size() == model_.size() || added.state.terms.back().maps) return std::nullopt;
  const double rest = left_of(problem_, added, own);
  if (rest < explained) return std::nullopt;
  const double nearly_all = std::max(explained, 1 + hardly_any * (rest - 1));
  std::optional<MapTrial> alone = maps_alone(nearly_all);
  if (!alone || alone->left > nearly_all || !significant(alone->trial.score) ||
      bic(added) - bic(alone->trial.fit) < worth)
    return std::nullopt;
  return std::move(alone->trial.fit);
}

/// Where something is left: the search once more, begun with maps. Other effects may have taken the place of one that
/// was hidden behind them.
void Selection::grow_from_maps() {
  if (problem_.allowed.residue || terms().size() == model_.size() || left() < explained) return;
  const double gained = bic(original_.fit) - bic(best_.fit);
  std::optional<MapTrial> alone = maps_alone(explained);
  if (!alone || !significant(alone->trial.score) ||
      bic(original_.fit) - bic(alone->trial.fit) < promising_maps * gained)
    return;
  Kept before = kept();
  const double reached = bic(best_.fit);
  if (!try_refine(std::move(alone->trial.fit.state))) return;
  add_all();
  // With other boards there is no comparison.
  if (bic(best_.fit) > reached || (problem_.allowed.boards == nullptr) != (before.allowed.boards == nullptr))
    restore(std::move(before));
}

/// Where several effects with maps were added: the search for effects with a few parameters in the place of one of
/// them. A map can do what a lens does to the amplitude, at the price of all its numbers. With boards that are not flat
/// there is no comparison.
void Selection::replace_maps() {
  std::vector<const Candidate*> with_maps;
  for (std::size_t t = model_.size(); t < terms().size(); ++t) {
    if (terms()[t].maps) with_maps.push_back(terms()[t].candidate);
  }
  if (problem_.allowed.residue || problem_.allowed.boards || with_maps.size() < 2) return;
  for (const Candidate* one : with_maps) {
    Kept before = kept();
    bool better = false;
    try {
      better = grown_without(*one, in_its_place, -worth);
    } catch (const simulation::EffectError&) {  // without it the others give no number
    }
    note({"maps", {one->name()}, {}, better ? "others do more in its place" : "stays"});
    if (better) return;
    restore(std::move(before));
  }
}

}  // namespace tofgraph::diagnosis
