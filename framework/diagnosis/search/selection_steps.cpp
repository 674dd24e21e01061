// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Steps of a selection, in the order of forward_select().
#include "diagnosis/model/smooth_field.hpp"
#include "diagnosis/search/selection.hpp"

#include "diagnosis/search/trials.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// Identity of a model: effects and their free parameters.
std::vector<const Candidate*> identity_of(const std::vector<Term>& terms) {
  std::vector<const Candidate*> identity;
  for (const Term& term : terms) identity.push_back(term.candidate);
  return identity;
}

/// True if the residual remains unexplained and hardly smaller. @param before lack of fit @param now the same
/// afterwards
bool hardly_reduces(double before, double now) {
  return now >= settings.explained && before - now < settings.min_excess_reduction * (before - 1);
}

}  // namespace

void Selection::forward_select() {
  select_from_boards();
  add_all();
  select_from_maps();
  backward_eliminate();
  replace_maps();
  select_beside_nuisances();
}

/// Repeats the search, starting with board heights that may be the camera's: of a single target, or with effects, which
/// would imitate them otherwise. Accepted only if everything is then explained, and neither effects nor maps alone
/// explain everything.
void Selection::select_from_boards() {
  const BoardTrial boards = lack_of_fit_of_best() < settings.explained ? BoardTrial{} : boards_.trial_for(best().state);
  if (!boards.boards || boards.sure) return;
  if (const std::optional<ModelFit> next =
          subsets_.best_set(selected_, settings.board_min_subset_promise * boards.gain);
      next && lack_of_fit(problem(), with_jacobian(problem(), *next)) < settings.explained)
    return;
  if (const std::optional<MapTrial> maps = maps_.alone(selected_, settings.explained);
      maps && maps->lack_of_fit < settings.explained)
    return;
  SelectedModel before = selected_;
  selected_.unsure_boards = true;
  if (allow_boards(boards.boards)) add_all();
  if (!best().state.nuisances.boards || lack_of_fit_of_best() >= settings.explained) select(std::move(before));
}

/// Adds the best set of effects; or maps, if none is worth its parameters or nearly all remains unexplained; or updates
/// a smooth field in use, if that gains more. Heights of several boards come first, because sets of effects would
/// imitate them. @returns true if something was added
bool Selection::add_best() {
  const bool lacking = lack_of_fit_of_best() >= settings.explained;
  const BoardTrial boards = lacking ? boards_.trial_for(best().state) : BoardTrial{};
  if (boards.sure && allow_boards(boards.boards)) return true;
  SmoothFieldTrial smooth_field;
  if (best().state.nuisances.smooth_field && lacking) smooth_field = smooth_field_of(problem(), best());
  std::optional<ModelFit> next = subsets_.best_set(selected_);
  const auto beaten = [&] { return !next || bic(best()) - bic(*next) < smooth_field.gain; };
  // A smooth field that lasts would look like maps, so none are tried with one.
  const auto hardly_helps = [&] {
    return hardly_reduces(lack_of_fit_of_best(), lack_of_fit(problem(), with_jacobian(problem(), *next)));
  };
  if ((beaten() || (lacking && hardly_helps())) && !best().state.nuisances.smooth_field) {
    std::optional<ModelFit> maps = maps_.best(selected_);
    if (maps && (!next || bic(*maps) < bic(*next))) next = std::move(maps);
  }
  if (!beaten()) {
    const std::size_t before = untried_count();
    return try_accept(std::move(next->state)) || (untried_count() > before && add_best());
  }
  if (!smooth_field.smooth_field) return false;
  ConditionNuisances more = best().state.nuisances;
  more.smooth_field = std::move(smooth_field.smooth_field), more.runs = std::move(smooth_field.runs);
  return allow(std::move(more));
}

void Selection::add_all() {
  // Dropped effects may be tried again, so the rounds are limited, not only the number of effects.
  for (std::size_t round = 0; round < (best().state.nuisances.smooth_field ? 2 : 2 * task_.options.max_effects);
       ++round) {
    const bool first = task_.added(best()) == 0;
    const double before = lack_of_fit_of_best(), bic_before = bic(best());
    const auto having = identity_of(terms());
    const ConditionNuisances before_nuisances = best().state.nuisances;
    if (!add_best()) break;
    if (std::optional<ModelFit> maps = first ? maps_.in_place_of(best(), selected_) : std::nullopt) {
      std::optional<ModelFit> next = subsets_.best_set(selected_);  // one more effect may explain as much as maps
      const bool more = next && bic(*next) < bic(*maps);
      if (!more || !try_accept(std::move(next->state))) try_accept(std::move(maps->state));
    }
    reached_ = selected_;
    backward_eliminate();
    reached_ = selected_;
    // The addition was eliminated again, because maps replaced it: this would repeat forever.
    const bool allows_more = best().state.nuisances.smooth_field != before_nuisances.smooth_field ||
                             !best().state.nuisances.boards != !before_nuisances.boards;
    if (!allows_more && identity_of(terms()) == having && bic(best()) > bic_before - settings.min_bic_gain) break;
    // A residual that additions hardly reduce has causes outside the catalogue, of which each addition would imitate a
    // part.
    if (!first && hardly_reduces(before, lack_of_fit_of_best())) break;
  }
}

/// Repeats the search, starting with maps, if a residual is unexplained: other effects may have replaced one that was
/// hidden by them.
void Selection::select_from_maps() {
  if (best().state.nuisances.smooth_field || task_.added(best()) == 0 || lack_of_fit_of_best() < settings.explained)
    return;
  const double gained = bic(selected_.refitted_given) - bic(best());
  std::optional<MapTrial> alone = maps_.alone(selected_, settings.explained);
  if (!alone || !significant(alone->score) ||
      bic(selected_.refitted_given) - bic(alone->fit) < settings.map_start_share * gained)
    return;
  SelectedModel before = selected_;
  const double bic_before = bic(best());
  if (!try_accept(std::move(alone->fit.state))) return;
  add_all();
  // With other boards models cannot be compared.
  if (bic(best()) > bic_before ||
      (best().state.nuisances.boards == nullptr) != (before.best.state.nuisances.boards == nullptr))
    select(std::move(before));
}

/// Removes additions that are not worth their parameters, the least valuable first.
void Selection::backward_eliminate() {
  while (additions().size() > 1) {
    const ModelFit* least = nullptr;
    std::string name;
    const std::vector<ModelTerm> all = additions();
    const std::vector<double> rises = min_deviance_rises(problem(), best(), all);
    for (std::size_t p = 0; p < all.size(); ++p) {
      const ModelTerm& addition = all[p];
      const auto parameters = static_cast<double>(values_of(terms()[addition.term], addition).size());
      if (rises[p] > settings.clearly_worth *
                         (settings.min_bic_gain + parameters * std::log(static_cast<double>(problem().data.size()))))
        continue;
      const ModelFit& less = without(addition);
      if (!(bic(less) < bic(least != nullptr ? *least : best()) + (least != nullptr ? 0 : settings.min_bic_gain)))
        continue;
      least = &less;
      name = name_of(terms()[addition.term], addition);
    }
    if (least == nullptr) return;
    task_.note({"taken out", {name}, {{"bic_rise", bic(*least) - bic(best())}}, "not worth its parameters"});
    if (!try_accept(least->state)) return;
  }
}

/// If several effects with maps were added, searches for effects with few parameters in place of one of them: a map can
/// imitate the effect of a lens on the amplitude, at the price of all its values. With much light a map also gains from
/// small errors of that effect's formula, so the few parameters may lose a little, if they explain everything. Not with
/// board heights, because models with different heights cannot be compared.
void Selection::replace_maps() {
  std::vector<const Candidate*> with_maps;
  for (std::size_t t = task_.given_terms.size(); t < terms().size(); ++t) {
    if (terms()[t].maps) with_maps.push_back(terms()[t].candidate);
  }
  if (best().state.nuisances.smooth_field || best().state.nuisances.boards || with_maps.size() < 2) return;
  for (const Candidate* one : with_maps) {
    SelectedModel before = selected_;
    bool better = false;
    try {
      better = reselect_without(*one, settings.map_replacement_promise, -settings.min_bic_gain,
                                settings.map_replacement_loss);
    } catch (const simulation::EffectError&) {  // the others fail without it
    }
    task_.note({"maps", {one->name()}, {}, better ? "others do more in its place" : "stays"});
    if (better) return;
    select(std::move(before));
  }
}

/// Removes an effect and adds sets of effects. @param promised fraction of its gain that the first set must predict
/// @param limit largest rise of BIC @param loss fraction of its gain by which BIC may rise if everything is explained
/// @returns true if BIC rises by less
bool Selection::reselect_without(const Candidate& one, double promised, double limit, double loss) {
  const double bic_before = bic(best()), deviance = best().deviance;
  State state = best().state;
  std::erase_if(state.terms, [&](const Term& term) { return term.candidate == &one; });
  fit_and_accept(std::move(state));
  const double gain = best().deviance - deviance, limit_if_explained = std::max(limit, loss * gain);
  double least = promised * gain;
  for (std::size_t round = 0; round < task_.options.max_effects; ++round) {
    std::optional<ModelFit> next = subsets_.best_set(selected_, least);
    if (!next) break;
    const std::size_t before = untried_count();
    if (try_accept(std::move(next->state)))
      least = 0;
    else if (untried_count() == before)
      break;
  }
  if (best().deviance > bic_before + limit_if_explained) return false;  // elimination only raises it
  backward_eliminate();
  const bool explained = lack_of_fit_of_best() < settings.explained;
  return bic(best()) < bic_before + (explained ? limit_if_explained : limit);
}

bool Selection::exchange(const Candidate& one, const Candidate& barred) {
  if (best().state.nuisances.boards) return false;  // with other boards models cannot be compared
  SelectedModel before = selected_;
  const std::vector<Term> those = terms();
  const auto stays = [&](const Term& term) { return term.candidate == &one || is_in(best().state, *term.candidate); };
  selected_.barred.push_back(&barred);
  try {
    if (reselect_without(one, 0, settings.min_bic_gain, 0) && terms().size() >= those.size() &&
        std::ranges::all_of(those, stays))
      return true;
  } catch (const simulation::EffectError&) {  // the others fail without it
  }
  select(std::move(before));
  return false;
}

bool Selection::select_beside_nuisances(bool anew) {
  if (!update_nuisances()) return false;
  if (anew && lack_of_fit_of_best() >= settings.explained && subsets_.promises_as_before(selected_)) {
    task_.note({"allowed", {}, {}, "sets of effects promise what they did: none are looked for again"});
    refit();
    return false;
  }
  add_all();
  backward_eliminate();
  return true;
}

/// Estimates nuisances of conditions: misplaced boards, and a residual that is smooth over the image. Called when no
/// effect helps any more, because effects and these nuisances can be mistaken for each other.
/// @returns true if a new nuisance was included
bool Selection::update_nuisances() {
  ConditionNuisances more = best().state.nuisances;
  more.jitter_scale = jitter_scale_of(board_offsets_of(problem(), best().state));
  double most = 0;
  for (std::size_t i = 0; i < more.jitter_scale.size(); ++i)
    most = std::max(most, std::abs(std::log(more.jitter_scale[i] / (best().state.nuisances.jitter_scale.empty()
                                                                        ? 1
                                                                        : best().state.nuisances.jitter_scale[i]))));
  SmoothFieldTrial smooth_field;
  if (best().state.nuisances.smooth_field || (additions().empty() && lack_of_fit_of_best() >= settings.explained))
    smooth_field = smooth_field_of(problem(), best());
  if (most < settings.jitter_scale_change && !smooth_field.smooth_field) return false;
  if (smooth_field.smooth_field)
    more.smooth_field = std::move(smooth_field.smooth_field), more.runs = std::move(smooth_field.runs);
  return allow(std::move(more));
}

/// @returns false if an effect fails in the fit with these nuisances; nothing changes then
bool Selection::allow(ConditionNuisances more) {
  task_.report_progress("allowing for what conditions have of their own");
  SelectedModel before = selected_;
  Step step{"allowed",
            {},
            {{"smooth_residue_m", more.smooth_field ? more.smooth_field->sd() : 0},
             {"boards_m", more.boards ? more.boards->sd : 0},
             {"loosest_board", more.jitter_scale.empty() ? 1 : std::ranges::max(more.jitter_scale)}},
            "effects are looked for again beside it"};
  bool could = true;
  try {
    State with = best().state;
    with.nuisances = std::move(more);
    fit_and_accept(std::move(with));
    refit_given(selected_.given_comparable_with_best().state);
  } catch (const simulation::EffectError& error) {
    select(std::move(before));
    step.outcome = error.what();
    could = false;
  }
  task_.note(std::move(step));
  return could;
}

/// Includes board heights. Effects partly absorbed by them regain that part when the heights are estimated again.
/// @returns true if heights remain
bool Selection::allow_boards(std::shared_ptr<const Boards> boards) {
  ConditionNuisances more = best().state.nuisances;
  more.boards = std::move(boards);
  return allow(std::move(more)) && best().state.nuisances.boards;
}

}  // namespace tofgraph::diagnosis
