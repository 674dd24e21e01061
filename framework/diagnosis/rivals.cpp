// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/rivals.hpp"

#include "diagnosis/contribution.hpp"
#include "diagnosis/validation.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

constexpr double tie_limit = 10;       ///< of deviance or BIC
constexpr double rival_share = 0.5;    ///< of the best linear gain, to be fitted in the place of one that was found
constexpr double close_behind = 0.01;  ///< of a gain: rivals that are settled by every pixel, as the best one was

/// One rival a candidate: tied, if it is in any form, else one that does as much.
void put(std::vector<Rival>& rivals, Rival rival) {
  const auto rank = [](const Rival& one) { return std::tuple(!one.tied, !one.does_as_much(), one.bic); };
  const auto known = std::ranges::find(rivals, rival.candidate, &Rival::candidate);
  if (known == rivals.end())
    rivals.push_back(std::move(rival));
  else if (rank(rival) < rank(*known))
    *known = std::move(rival);
}

/// All of them, and where these are more than two all but one.
std::vector<std::vector<std::size_t>> parts_of_set(const std::vector<std::size_t>& terms) {
  std::vector<std::vector<std::size_t>> parts = {terms};
  for (std::size_t out = 0; terms.size() > 2 && out < terms.size(); ++out) {
    parts.push_back(terms);
    parts.back().erase(parts.back().begin() + static_cast<std::ptrdiff_t>(out));
  }
  return parts;
}

/// Which of a state's terms is a candidate's, in any of its forms; their number, if none is.
std::size_t term_of(const State& state, const Candidate& candidate) {
  const auto is_it = [&](const Term& term) { return &term.candidate->root() == &candidate; };
  return static_cast<std::size_t>(std::ranges::find_if(state.terms, is_it) - state.terms.begin());
}

}  // namespace

/// Nothing where it is no better than the model without what it stands in the place of.
std::optional<Rival> Rivals::compared(const Base& less, const Candidate& candidate,
                                      std::vector<std::string> in_place_of, Fit fit) {
  const Fit& best = selection_.best().fit;
  if (!(fit.deviance < less.fit.deviance)) return std::nullopt;
  const double behind = fit.deviance - best.deviance;
  if (behind > tie_limit && behind < close_behind * (less.fit.deviance - best.deviance)) {
    try {
      fit = selection_.settled(fit.state);
    } catch (const simulation::EffectError&) {  // it cannot do all pixels: as it is
    }
  }
  Rival rival{&candidate, std::move(in_place_of), fit.deviance - best.deviance,
              selection_.bic(fit) - selection_.bic(best)};
  rival.tied =
      std::min(rival.deviance, rival.bic) < tie_limit || hardly_differ(problem_, best.state, fit.state, tie_limit);
  if (rival.tied) {
    const Silence silence = silence_of_shape(fit, candidate);
    rival.untold = silence.shape;
    rival.limit = silence.at_limit ? silence.why : limit_reached(fit, candidate);
    rival.tied = rival.limit.empty();
  }
  rival.state = std::move(fit.state);
  return rival;
}

std::vector<Rival> Rivals::of(const Found& found, std::size_t term) {
  const Base& less = selection_.without({term, std::nullopt});
  const InLightOf there(problem_, less);
  const std::vector<std::string> alike = confused_with(*found.candidate, candidates_);
  std::vector<Rival> rivals;
  const auto compare = [&](const Candidate& candidate, Fit fit) {
    if (std::optional<Rival> rival = compared(less, candidate, {found.name}, std::move(fit)))
      put(rivals, *std::move(rival));
  };
  for (Trial& trial : trials_.best(less, found.candidate, rival_share, alike))
    compare(trial.candidate->root(), std::move(trial.fit));
  // A map of the pixels is the same in all conditions, as what belongs to the set-up may be: a tilt at one distance.
  const bool of_set_up = found.candidate->border().scope == TOFGRAPH_SCOPE_SETUP && problem_.design.superpixels() > 1;
  for (const auto& candidate : candidates_) {
    const bool asked = of_set_up && std::ranges::find(alike, candidate->name()) != alike.end();
    if (!asked || candidate->maps().empty() || is_in(less.fit.state, *candidate)) continue;
    try {
      compare(*candidate, fit_with_map_of(problem_, less.fit.state, *candidate, selection_.weight()));
    } catch (const simulation::EffectError&) {  // it gives no number there
    }
  }
  // What is said to be like it may be so in another form alone, or with other maps beside it.
  for (const auto& candidate : candidates_) {
    if (std::ranges::find(alike, candidate->name()) == alike.end() || is_in(less.fit.state, *candidate)) continue;
    const auto known = std::ranges::find(rivals, candidate.get(), &Rival::candidate);
    const bool tied = known != rivals.end() && known->tied;
    if (tied || (candidate->refinements().empty() && !has_maps(less.fit.state))) continue;
    for (Fit& fit : selection_.with(less, *candidate)) compare(*candidate, std::move(fit));
  }
  std::ranges::stable_sort(rivals, {}, &Rival::bic);
  return rivals;
}

/// Of the first of its shapes that these data do not tell.
Silence Rivals::silence_of_shape(const Fit& fit, const Candidate& candidate) const {
  const std::size_t term = term_of(fit.state, candidate);
  const auto may_be_anything = [](const FreeParameter& p) { return p.shape && !p.is_angle(); };
  if (term == fit.state.terms.size() || std::ranges::none_of(fit.state.terms[term].candidate->free(), may_be_anything))
    return {};
  const double rest = left_of(problem_, fit, own_columns(problem_, fit.state, expected(problem_, fit.state)));
  const std::vector<Interval> values = intervals(problem_, fit, seed_, rest, Refinements::as_they_are);
  return silence_of(fit, term, values, rest);
}

/// Of the first of its shapes that is near its limit, where it does as much at the limit itself; or "".
std::string Rivals::limit_reached(const Fit& fit, const Candidate& candidate) const {
  State end = fit.state;
  const std::size_t at = term_of(end, candidate);
  if (at == end.terms.size()) return "";
  Term& term = end.terms[at];
  for (std::size_t k = 0; k < term.values.size(); ++k) {
    const FreeParameter& p = term.candidate->free()[k];
    std::string limit = limit_of(p, term.values[k]);
    if (limit.empty()) continue;
    const double here = std::exchange(term.values[k], p.minimum);
    try {
      if (deviance_of(problem_, end) - deviance_of(problem_, fit.state) < tie_limit) return limit;
    } catch (const simulation::EffectError&) {  // it gives no number there
    }
    term.values[k] = here;
  }
  return "";
}

/// In the place of all of these, if it does as much. @param terms ascending
std::optional<Rival> Rivals::in_place_of_all(const Candidate& candidate, const std::vector<std::size_t>& terms) {
  Base less = selection_.best();
  std::vector<std::string> names;
  for (const std::size_t term : terms) names.push_back(selection_.terms()[term].candidate->name());
  std::vector<Rival> rivals;
  try {
    for (auto term = terms.rbegin(); term != terms.rend(); ++term)
      less = without(problem_, less, {*term, std::nullopt}, selection_.weight());
    const InLightOf there(problem_, less);
    for (Fit& fit : selection_.with(less, candidate))
      if (std::optional<Rival> rival = compared(less, candidate, names, std::move(fit))) put(rivals, *std::move(rival));
  } catch (const simulation::EffectError&) {  // it gives no number there
  }
  return !rivals.empty() && rivals.front().does_as_much() ? std::optional(std::move(rivals.front())) : std::nullopt;
}

void Rivals::add_of_several(std::vector<Found>& all, std::size_t first_term) {
  const auto stands_for_several = [](const Found& found) {
    return std::ranges::any_of(found.rivals, [](const Rival& one) { return one.tied && one.of_several(); });
  };
  for (const auto& candidate : candidates_) {
    if (candidate->sizes() == 0 || !candidate->maps().empty() || is_in(selection_.best().fit.state, *candidate))
      continue;
    const std::vector<std::string> alike = confused_with(*candidate, candidates_);
    std::vector<std::size_t> terms;
    for (std::size_t f = 0; f < all.size(); ++f) {
      if (std::ranges::find(alike, all[f].name) != alike.end() && !stands_for_several(all[f]))
        terms.push_back(first_term + f);
    }
    if (terms.size() < 2) continue;
    std::optional<Rival> rival;  // one that is tied, else one that does as much
    std::vector<std::size_t> place;
    for (const std::vector<std::size_t>& some : parts_of_set(terms)) {
      std::optional<Rival> one = in_place_of_all(*candidate, some);
      if (!one || (rival && !one->tied)) continue;
      rival = std::move(one), place = some;
      if (rival->tied) break;
    }
    for (const std::size_t term : place) {
      std::vector<Rival>& rivals = all[term - first_term].rivals;
      const auto known = std::ranges::find(rivals, candidate.get(), &Rival::candidate);
      if (known != rivals.end() && known->tied && !rival->tied) continue;
      if (known != rivals.end()) rivals.erase(known);
      const auto worse = [&](const Rival& one) { return one.bic > rival->bic; };
      rivals.insert(std::ranges::find_if(rivals, worse), *rival);
    }
  }
}

}  // namespace tofgraph::diagnosis
