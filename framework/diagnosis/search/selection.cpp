// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/selection.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/search/least_rise.hpp"
#include "diagnosis/search/map_gauge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// Identity of a model: effects, and which of their parameters are free.
std::vector<const Candidate*> forms_of(const std::vector<Term>& terms) {
  std::vector<const Candidate*> forms;
  for (const Term& term : terms) forms.push_back(term.candidate);
  return forms;
}

}  // namespace

Selection::Selection(const Problem& problem, const std::vector<Term>& model,
                     const std::vector<std::unique_ptr<Candidate>>& candidates, const SearchOptions& options,
                     std::map<std::string, std::string> refused)
    : problem_{problem.design, problem.data, problem.targets, problem.target, problem.nuisances, &deadline_},
      model_(model),
      candidates_(candidates),
      options_(options),
      refused_(std::move(refused)),
      weight_(problem.data.size(), 1.0) {
  if (problem.deadline != nullptr) deadline_ = *problem.deadline;
}

void Selection::begin() {
  report_progress("fitting the model as it is");
  State start = first_state(problem_, model_);
  if (!model_.empty()) update_grid_bias(problem_, start);
  accept(fit(problem_, start, weight_));
  original_ = best_;
  reached_ = kept();
  deadline_ = options_.deadline;
}

void Selection::linearise() {
  if (options_.max_effects > 0) alternatives_ = alternatives_of(problem_, best_.state, candidates_, refused_);
}

void Selection::accept(ModelFit fit) {
  without_.clear();
  best_ = linearised(problem_, std::move(fit));
}

/// The model as it is, with the nuisances of the best one and at its grid bias, so that both can be compared.
ModelFit Selection::original_beside_best() const {
  ModelFit given = original_;
  given.state.nuisances = best_.state.nuisances;
  given.state.linearisation.grid_bias = best_.state.linearisation.grid_bias;
  return given;
}

void Selection::return_to_given() {
  State given = best_.state;
  given.terms = model_;
  if (!model_.empty()) update_grid_bias(problem_, given);
  ModelFit fit = fit_nuisances(problem_, std::move(given), weight_);
  const auto rows = expected(problem_, fit.state);
  const std::vector<Column> columns = jacobian(problem_, fit.state, rows);
  const Solution there = solve_linear(problem_, fit.state, rows, columns, problem_.unknowns(columns.size()));
  fit.covariance = there.covariance;
  fit.dimension = there.dimension;
  accept(std::move(fit));
}

void Selection::refit() {
  if (terms().empty()) return;
  report_progress("settling on values");
  State exact = best_.state;
  update_grid_bias(problem_, exact, true);
  const State positive = with_positive_amplitudes(problem_, std::move(exact));
  accept(fit_with_maps(problem_, with_means_in_constant(problem_, positive), weight_));
}

ModelFit Selection::refitted(State state) const {
  state.nuisances = best_.state.nuisances;
  update_grid_bias(problem_, state, true);
  return fit_with_maps(problem_, with_positive_amplitudes(problem_, std::move(state)), weight_);
}

void Selection::forward_select() {
  select_from_boards();
  add_all();
  select_from_maps();
  backward_eliminate();
  replace_maps();
  select_beside_nuisances();
}

bool Selection::select_beside_nuisances(bool anew) {
  if (!update_nuisances()) return false;
  if (anew && left() >= settings.explained && promises_as_before()) {
    note({"allowed", {}, {}, "sets of effects promise what they did: none are looked for again"});
    refit();
    return false;
  }
  add_all();
  backward_eliminate();
  return true;
}

/// Adds what explains most for its parameters: the best set of effects, or where none is worth its own maps; or, where
/// a residue is allowed, another size of it: that has one parameter, but pays for being any shape. Shapes of several
/// boards come first: sets of effects would make up for them. @returns whether there is anything
bool Selection::add_best() {
  const bool lacking = left() >= settings.explained;
  const BoardTrial boards = lacking ? boards_beside(best_.state) : BoardTrial{};
  if (boards.sure && allow_boards(boards.boards)) return true;
  SmoothFieldTrial smooth_field;
  if (best_.state.nuisances.smooth_field && lacking) smooth_field = smooth_field_of(problem_, best_);
  std::optional<ModelFit> next = search_subsets();
  const auto beaten = [&] { return !next || bic(best_) - bic(*next) < smooth_field.gain; };
  // A residue that is the same each time would look like maps: none are looked for beside one.
  if ((beaten() || (lacking && leaves_nearly_all(*next))) && !best_.state.nuisances.smooth_field) {
    std::optional<ModelFit> maps = good_maps();
    if (maps && (!next || bic(*maps) < bic(*next))) next = std::move(maps);
  }
  if (!beaten()) {
    const std::size_t before = left_out();
    return try_refine(std::move(next->state)) || (left_out() > before && add_best());
  }
  if (!smooth_field.smooth_field) return false;
  ConditionNuisances more = best_.state.nuisances;
  more.smooth_field = std::move(smooth_field.smooth_field), more.runs = std::move(smooth_field.runs);
  return allow(std::move(more));
}

/// True if an addition reduces the unexplained residual hardly at all.
bool Selection::leaves_nearly_all(const ModelFit& added) const {
  const double now = lack_of_fit(problem_, linearised(problem_, added));
  return now >= settings.explained && left() - now < settings.min_excess_reduction * (left() - 1);
}

void Selection::add_all() {
  // What is dropped may be tried again, so the rounds are counted, not the effects alone.
  for (std::size_t round = 0; round < (best_.state.nuisances.smooth_field ? 2 : 2 * options_.max_effects); ++round) {
    const bool first = terms().size() == model_.size();
    const double before = left(), reached = bic(best_);
    const auto having = forms_of(terms());
    const ConditionNuisances before_nuisances = best_.state.nuisances;
    if (!add_best()) break;
    if (std::optional<ModelFit> maps = first ? maps_instead(best_) : std::nullopt) {
      std::optional<ModelFit> next = search_subsets();  // one effect more may do what maps do
      const bool more = next && bic(*next) < bic(*maps);
      if (!more || !try_refine(std::move(next->state))) try_refine(std::move(maps->state));
    }
    reached_ = kept();
    backward_eliminate();
    reached_ = kept();
    // What was added came out again, as maps took over what it did: so it would for ever.
    const bool allows_more =
        best_.state.nuisances.smooth_field != before_nuisances.smooth_field || !best_.state.nuisances.boards != !before_nuisances.boards;
    if (!allows_more && forms_of(terms()) == having && bic(best_) > reached - settings.min_bic_gain) break;
    // What stays unexplained whatever is added is none of the catalogue's, and each addition a stand-in for a bit of
    // it.
    if (const double now = left();
        !first && now >= settings.explained && before - now < settings.min_excess_reduction * (before - 1))
      break;
  }
}

std::vector<ModelTerm> Selection::pieces() const {
  std::vector<ModelTerm> all;
  for (std::size_t t = 0; t < terms().size(); ++t) {
    if (t >= model_.size()) all.push_back({t, std::nullopt});
    for (std::size_t r = 0; r < terms()[t].candidate->refinements().size(); ++r) {
      if (terms()[t].candidate->refined(r)) all.push_back({t, r});
    }
  }
  return all;
}

const ModelFit& Selection::without(const ModelTerm& piece) {
  const auto known = std::ranges::find(without_, piece, &std::pair<ModelTerm, ModelFit>::first);
  if (known != without_.end()) return known->second;
  return without_.emplace_back(piece, diagnosis::without(problem_, best_, piece, weight_)).second;
}

void Selection::drop(const ModelTerm& piece) { refine(without(piece).state); }

/// Takes out an effect, and adds sets of effects. @param promised share of what it gained that these must promise to
/// begin with @param limit of what BIC may rise by @returns whether the model is as good as that
bool Selection::reselect_without(const Candidate& one, double promised, double limit) {
  const double reached = bic(best_), deviance = best_.deviance;
  State state = best_.state;
  std::erase_if(state.terms, [&](const Term& term) { return term.candidate == &one; });
  refine(std::move(state));
  double least = promised * (best_.deviance - deviance);
  for (std::size_t round = 0; round < options_.max_effects; ++round) {
    std::optional<ModelFit> next = search_subsets(least);
    if (!next) break;
    const std::size_t before = left_out();
    if (try_refine(std::move(next->state)))
      least = 0;
    else if (left_out() == before)
      break;
  }
  if (best_.deviance > reached + limit) return false;  // what is taken out only raises it
  backward_eliminate();
  return bic(best_) < reached + limit;
}

bool Selection::exchange(const Candidate& one) {
  if (best_.state.nuisances.boards) return false;  // with other boards there is no comparison
  Kept before = kept();
  const std::vector<Term> those = terms();
  const auto stays = [&](const Term& term) { return term.candidate == &one || is_in(best_.state, *term.candidate); };
  barred_.push_back(&one.root());
  try {
    if (reselect_without(one, 0, settings.min_bic_gain) && terms().size() >= those.size() &&
        std::ranges::all_of(those, stays))
      return true;
  } catch (const simulation::EffectError&) {  // without it the others give no number
  }
  restore(std::move(before));
  return false;
}

/// Takes out what is not worth its parameters, the least of it first.
void Selection::backward_eliminate() {
  while (pieces().size() > 1) {
    const ModelFit* least = nullptr;
    std::string name;
    const std::vector<ModelTerm> all = pieces();
    const std::vector<double> rises = min_deviance_rises(problem_, best_, all);
    for (std::size_t p = 0; p < all.size(); ++p) {
      const ModelTerm& piece = all[p];
      const auto parameters = static_cast<double>(values_of(terms()[piece.term], piece).size());
      if (rises[p] > settings.clearly_worth *
                         (settings.min_bic_gain + parameters * std::log(static_cast<double>(problem_.data.size()))))
        continue;
      const ModelFit& less = without(piece);
      if (!(bic(less) < bic(least != nullptr ? *least : best_) + (least != nullptr ? 0 : settings.min_bic_gain)))
        continue;
      least = &less;
      name = name_of(terms()[piece.term], piece);
    }
    if (least == nullptr) return;
    note({"taken out", {name}, {{"bic_rise", bic(*least) - bic(best_)}}, "not worth its parameters"});
    if (!try_refine(least->state)) return;
  }
}

/// Fits with what the coarse grid misses of a state, its maps anew. @throws simulation::EffectError
void Selection::refine(State state) {
  update_grid_bias(problem_, state);
  accept(fit_with_maps(problem_, std::move(state), weight_));
  fit_boards();
}

/// As refine(); where an effect cannot do its images all stays as it was, and if it was new it is not tried again.
/// @returns whether it can
bool Selection::try_refine(State state) {
  Kept before = kept();
  try {
    refine(std::move(state));
    return true;
  } catch (const simulation::EffectError& error) {
    restore(std::move(before));
    note({"fitted", {error.effect}, {}, error.what()});
    const auto failing = std::ranges::find(candidates_, error.effect, [](const auto& one) { return one->name(); });
    if (failing == candidates_.end() || is_in(best_.state, **failing)) return false;
    if (!(*failing)->maps().empty())
      refused_.emplace(error.effect, error.what());
    else if (std::ranges::find(barred_, failing->get()) == barred_.end())
      barred_.push_back(failing->get());
    return false;
  }
}

Selection::Kept Selection::kept() const { return {original_, best_, barred_}; }

void Selection::restore(Kept before) {
  without_.clear();
  original_ = std::move(before.original);
  best_ = std::move(before.best);
  barred_ = std::move(before.barred);
}

}  // namespace tofgraph::diagnosis
