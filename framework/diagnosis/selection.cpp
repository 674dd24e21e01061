// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/selection.hpp"

#include "diagnosis/least_rise.hpp"
#include "diagnosis/map_gauge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

constexpr double worthwhile = 0.1;  ///< of the excess of chi-square: what an addition beside others must take away

/// What is clearly worth its parameters is not fitted without: so many times what it must be worth, linearised.
constexpr double clearly = 3;

/// What tells models apart: effects, and which of their parameters are free.
std::vector<const Candidate*> forms_of(const std::vector<Term>& terms) {
  std::vector<const Candidate*> forms;
  for (const Term& term : terms) forms.push_back(term.candidate);
  return forms;
}

}  // namespace

Selection::Selection(const Problem& problem, const std::vector<Term>& model,
                     const std::vector<std::unique_ptr<Candidate>>& candidates, const SearchOptions& options,
                     std::map<std::string, std::string> refused)
    : problem_(problem),
      model_(model),
      candidates_(candidates),
      options_(options),
      refused_(std::move(refused)),
      weight_(problem.data.size(), 1.0) {}

void Selection::begin() {
  say("fitting the model as it is");
  State start{model_, first_light(problem_), {}};
  if (!problem_.design.tells_offset()) start.variances.offset = 0;
  if (!model_.empty()) correct(problem_, start);
  take(fit(problem_, start, weight_));
  original_ = best_;
  original_.brightening = problem_.brightening;
  reached_ = kept();
  problem_.deadline = options_.deadline;
}

void Selection::linearise() {
  if (options_.max_effects > 0) alternatives_ = alternatives_of(problem_, best_.fit.state, candidates_, refused_);
}

void Selection::take(Fit fit) {
  without_.clear();
  best_.columns = own_columns(problem_, fit.state, expected(problem_, fit.state));
  best_.fit = std::move(fit);
}

void Selection::return_to_given() {
  State given{model_, best_.fit.state.light, best_.fit.state.variances};
  if (!model_.empty()) correct(problem_, given);
  Fit fit = fit_nuisances(problem_, std::move(given), weight_);
  const auto rows = expected(problem_, fit.state);
  const std::vector<Column> columns = own_columns(problem_, fit.state, rows);
  const Solution there = least_squares(problem_, rows, columns, problem_.unknowns(columns.size()), fit.state.variances);
  fit.covariance = there.covariance;
  fit.dimension = there.dimension;
  take(std::move(fit));
}

void Selection::settle() {
  if (terms().empty()) return;
  say("settling on values");
  correct(problem_, best_.fit.state, true);
  const State positive = with_positive_sizes(problem_, best_.fit.state);
  take(fit_with_maps(problem_, with_means_in_constant(problem_, positive), weight_));
}

Fit Selection::settled(const State& state) const {
  Problem there = problem_;
  correct(there, state, true);
  return fit_with_maps(there, with_positive_sizes(there, state), weight_);
}

void Selection::grow() {
  grow_from_boards();
  add_all();
  grow_from_maps();
  drop_needless();
  replace_maps();
  grow_beside_conditions();
}

bool Selection::grow_beside_conditions(bool anew) {
  if (!look_at_conditions()) return false;
  if (anew && left() >= explained && promises_as_before()) {
    note({"allowed", {}, {}, "sets of effects promise what they did: none are looked for again"});
    settle();
    return false;
  }
  add_all();
  drop_needless();
  return true;
}

/// What explains most for its parameters: the best set of effects, or where none is worth its own maps; or, where a
/// residue is allowed, another size of it: that has one parameter, but pays for being any shape. Shapes of several
/// boards come first: sets of effects would make up for them. @returns whether there is anything
bool Selection::add_best() {
  const bool lacking = left() >= explained;
  const BoardTrial boards = lacking ? boards_beside(best_.fit.state) : BoardTrial{};
  if (boards.sure && allow_boards(boards.boards)) return true;
  ResidueTrial residue;
  if (problem_.allowed.residue && lacking) residue = residue_of(problem_, best_.fit);
  std::optional<Fit> next = leap();
  const auto beaten = [&] { return !next || bic(best_.fit) - bic(*next) < residue.gain; };
  // A residue that is the same each time would look like maps: none are looked for beside one.
  if ((beaten() || (lacking && leaves_nearly_all(*next))) && !problem_.allowed.residue) {
    std::optional<Fit> maps = good_maps();
    if (maps && (!next || bic(*maps) < bic(*next))) next = std::move(maps);
  }
  if (!beaten()) {
    const std::size_t before = left_out();
    return try_refine(std::move(next->state)) || (left_out() > before && add_best());
  }
  if (!residue.residue) return false;
  Allowances more = problem_.allowed;
  more.residue = std::move(residue.residue), more.runs = std::move(residue.runs);
  return allow(std::move(more));
}

/// Whether an addition takes hardly anything away of what is left.
bool Selection::leaves_nearly_all(const Fit& added) const {
  const double now = left_of(problem_, added, own_columns(problem_, added.state, expected(problem_, added.state)));
  return now >= explained && left() - now < worthwhile * (left() - 1);
}

void Selection::add_all() {
  // What is dropped may be tried again, so the rounds are counted, not the effects alone.
  for (std::size_t round = 0; round < (problem_.allowed.residue ? 2 : 2 * options_.max_effects); ++round) {
    const bool first = terms().size() == model_.size();
    const double before = left(), reached = bic(best_.fit);
    const auto having = forms_of(terms());
    const Allowances allowed = problem_.allowed;
    if (!add_best()) break;
    if (std::optional<Fit> maps = first ? maps_instead(best_.fit, best_.columns) : std::nullopt) {
      std::optional<Fit> next = leap();  // one effect more may do what maps do
      const bool more = next && bic(*next) < bic(*maps);
      if (!more || !try_refine(std::move(next->state))) try_refine(std::move(maps->state));
    }
    reached_ = kept();
    drop_needless();
    reached_ = kept();
    // What was added came out again, as maps took over what it did: so it would for ever.
    const bool allows_more = problem_.allowed.residue != allowed.residue || !problem_.allowed.boards != !allowed.boards;
    if (!allows_more && forms_of(terms()) == having && bic(best_.fit) > reached - worth) break;
    // What stays unexplained whatever is added is none of the catalogue's, and each addition a stand-in for a bit of
    // it.
    if (const double now = left(); !first && now >= explained && before - now < worthwhile * (before - 1)) break;
  }
}

std::vector<Piece> Selection::pieces() const {
  std::vector<Piece> all;
  for (std::size_t t = 0; t < terms().size(); ++t) {
    if (t >= model_.size()) all.push_back({t, std::nullopt});
    for (std::size_t r = 0; r < terms()[t].candidate->refinements().size(); ++r) {
      if (terms()[t].candidate->refined(r)) all.push_back({t, r});
    }
  }
  return all;
}

const Base& Selection::without(const Piece& piece) {
  const auto known = std::ranges::find(without_, piece, &std::pair<Piece, Base>::first);
  if (known != without_.end()) return known->second;
  return without_.emplace_back(piece, diagnosis::without(problem_, best_, piece, weight_)).second;
}

void Selection::drop(const Piece& piece) { refine(without(piece).fit.state); }

/// Takes out an effect, and adds sets of effects. @param promised share of what it gained that these must promise to
/// begin with @param limit of what BIC may rise by @returns whether the model is as good as that
bool Selection::grown_without(const Candidate& one, double promised, double limit) {
  const double reached = bic(best_.fit), deviance = best_.fit.deviance;
  State state = best_.fit.state;
  std::erase_if(state.terms, [&](const Term& term) { return term.candidate == &one; });
  refine(std::move(state));
  double least = promised * (best_.fit.deviance - deviance);
  for (std::size_t round = 0; round < options_.max_effects; ++round) {
    std::optional<Fit> next = leap(least);
    if (!next) break;
    const std::size_t before = left_out();
    if (try_refine(std::move(next->state)))
      least = 0;
    else if (left_out() == before)
      break;
  }
  if (best_.fit.deviance > reached + limit) return false;  // what is taken out only raises it
  drop_needless();
  return bic(best_.fit) < reached + limit;
}

bool Selection::exchange(const Candidate& one) {
  if (problem_.allowed.boards) return false;  // with other boards there is no comparison
  Kept before = kept();
  const std::vector<Term> those = terms();
  const auto stays = [&](const Term& term) {
    return term.candidate == &one || is_in(best_.fit.state, *term.candidate);
  };
  barred_.push_back(&one.root());
  try {
    if (grown_without(one, 0, worth) && terms().size() >= those.size() && std::ranges::all_of(those, stays))
      return true;
  } catch (const simulation::EffectError&) {  // without it the others give no number
  }
  restore(std::move(before));
  return false;
}

/// Takes out what is not worth its parameters, the least of it first.
void Selection::drop_needless() {
  while (pieces().size() > 1) {
    const Fit* least = nullptr;
    std::string name;
    const std::vector<Piece> all = pieces();
    const std::vector<double> rises = least_rises(problem_, best_, all);
    for (std::size_t p = 0; p < all.size(); ++p) {
      const Piece& piece = all[p];
      const auto parameters = static_cast<double>(values_of(terms()[piece.term], piece).size());
      if (rises[p] > clearly * (worth + parameters * std::log(static_cast<double>(problem_.data.size())))) continue;
      const Fit& less = without(piece).fit;
      if (!(bic(less) < bic(least != nullptr ? *least : best_.fit) + (least != nullptr ? 0 : worth))) continue;
      least = &less;
      name = name_of(terms()[piece.term], piece);
    }
    if (least == nullptr) return;
    note({"taken out", {name}, {{"bic_rise", bic(*least) - bic(best_.fit)}}, "not worth its parameters"});
    if (!try_refine(least->state)) return;
  }
}

/// Fits with what the coarse grid misses of a state, its maps anew. @throws simulation::EffectError
void Selection::refine(State state) {
  correct(problem_, state);
  take(fit_with_maps(problem_, std::move(state), weight_));
  settle_boards();
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
    if (failing == candidates_.end() || is_in(best_.fit.state, **failing)) return false;
    if (!(*failing)->maps().empty())
      refused_.emplace(error.effect, error.what());
    else if (std::ranges::find(barred_, failing->get()) == barred_.end())
      barred_.push_back(failing->get());
    return false;
  }
}

Selection::Kept Selection::kept() const {
  return {original_, best_, problem_.correction, problem_.brightening, problem_.allowed, barred_};
}

void Selection::restore(Kept before) {
  without_.clear();
  original_ = std::move(before.original);
  best_ = std::move(before.best);
  problem_.correction = std::move(before.correction);
  problem_.brightening = std::move(before.brightening);
  problem_.allowed = std::move(before.allowed);
  barred_ = std::move(before.barred);
}

}  // namespace tofgraph::diagnosis
