// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/rivals.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/validation.hpp"
#include "diagnosis/search/search.hpp"

#include <algorithm>
#include <set>
#include <tuple>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// Keeps one rival per candidate: a tied form if there is one, else one that explains as much.
void put(std::vector<Rival>& rivals, Rival rival) {
  const auto rank = [](const Rival& one) { return std::tuple(!one.tied, !one.does_as_much(), one.bic); };
  const auto known = std::ranges::find(rivals, rival.candidate, &Rival::candidate);
  if (known == rivals.end())
    rivals.push_back(std::move(rival));
  else if (rank(rival) < rank(*known))
    *known = std::move(rival);
}

/// The whole set, and if it has more than two terms, each subset that lacks one.
std::vector<std::vector<std::size_t>> parts_of_set(const std::vector<std::size_t>& terms) {
  std::vector<std::vector<std::size_t>> parts = {terms};
  for (std::size_t out = 0; terms.size() > 2 && out < terms.size(); ++out) {
    parts.push_back(terms);
    parts.back().erase(parts.back().begin() + static_cast<std::ptrdiff_t>(out));
  }
  return parts;
}

}  // namespace

std::string Rival::separating_experiment(const Candidate& found) const {
  const bool own_advice =
      of_several() || (lists_as_confusable(*candidate, found) && !lists_as_confusable(found, *candidate));
  return (own_advice ? *candidate : found).border().experiment;
}

void sort_ties(std::vector<Rival>& rivals) {
  std::ranges::stable_sort(rivals, {}, [](const Rival& one) {
    return std::tuple(!one.tied, one.tied && one.undetermined, one.tied ? one.candidate->free().size() : 0);
  });
}

std::vector<std::string> names_with_rivals(const std::string& effect, std::span<const Rival> rivals) {
  std::vector<std::string> all = {effect};
  for (const Rival& rival : rivals) {
    if (rival.does_as_much()) all.push_back(rival.candidate->name());
  }
  return all;
}

bool differ_only_by(const State& one, std::span<const std::string> effects, const State& other,
                    const std::string& its) {
  const auto others = [](const State& of, std::span<const std::string> but) {
    std::multiset<std::string> names;
    for (const Term& term : of.terms) names.insert(term.candidate->name());
    for (const std::string& name : but) names.erase(name);
    return names;
  };
  return others(one, effects) == others(other, {&its, 1});
}

/// True if the design does not distinguish a candidate from a term.
bool Rivals::is_twin(const Candidate& candidate, const Term& term) const {
  const Candidate *const one = &candidate.root(), *const other = &term.candidate->root();
  return std::ranges::any_of(selection_.task().options.alike, [&](const Alike& pair) {
    return pair.cosine > settings.twins_above &&
           ((pair.first == one && pair.second == other) || (pair.first == other && pair.second == one));
  });
}

/// Fits of a candidate in the place of a term. Beside maps a fit that starts without the term may end far from the best
/// model, though the candidate changes the data as the term does: others then start there.
std::vector<ModelFit> Rivals::fits_in_place_of(std::size_t term, const ModelFit& less,
                                               const Candidate& candidate) const {
  std::vector<ModelFit> fits = selection_.forms_of(less, candidate);
  const ModelFit& best = selection_.best();
  const auto is_tied = [&](const ModelFit& fit) { return fit.deviance - best.deviance < settings.tie_limit; };
  if (!has_maps(less.state) || !is_twin(candidate, best.state.terms[term]) || std::ranges::any_of(fits, is_tied))
    return fits;
  try {
    ModelFit base{.state = removed(best.state, {term, std::nullopt})};
    base.deviance = deviance_of(problem_, base.state);
    for (ModelFit& fit : selection_.forms_of(with_jacobian(problem_, std::move(base)), candidate))
      fits.push_back(std::move(fit));
  } catch (const simulation::EffectError&) {  // another effect fails without the term
  }
  return fits;
}

/// Rival from a fit; nullopt if it is not better than the model without the effects that it replaces.
std::optional<Rival> Rivals::compared(const ModelFit& less, const Candidate& candidate,
                                      std::vector<std::string> in_place_of, ModelFit fit) {
  const ModelFit& best = selection_.best();
  if (!(fit.deviance < less.deviance)) return std::nullopt;
  const double behind = fit.deviance - best.deviance;
  if (behind > settings.tie_limit && behind < settings.close_rival * (less.deviance - best.deviance)) {
    try {
      fit = selection_.fit_at_every_pixel(fit.state);
      fit.state.precomputed = less.state.precomputed;  // equal in all models compared
    } catch (const simulation::EffectError&) {         // undefined in some pixel: the coarse fit is kept
    }
  }
  Rival rival{&candidate, std::move(in_place_of), fit.deviance - best.deviance,
              selection_.bic(fit) - selection_.bic(best)};
  rival.tied = std::min(rival.deviance, rival.bic) < settings.tie_limit ||
               practically_equivalent(problem_, best.state, fit.state);
  if (rival.tied) {
    const Unidentified unidentified = nonlinear_identifiability(fit, candidate);
    rival.undetermined = unidentified.nonlinear;
    rival.limit = unidentified.at_limit ? unidentified.why : limit_reached(fit, candidate);
    rival.tied = rival.limit.empty();
  }
  rival.state = std::move(fit.state);
  return rival;
}

/// Adds a candidate, in all its forms, as a rival of a term. @param less model without the term
void Rivals::put_in_place(const Candidate& candidate, const EffectFinding& found, std::size_t term,
                          const ModelFit& less, std::vector<Rival>& rivals) {
  if (is_in(less.state, candidate)) return;
  for (ModelFit& fit : fits_in_place_of(term, less, candidate))
    if (std::optional<Rival> rival = compared(less, candidate, {found.name}, std::move(fit)))
      put(rivals, *std::move(rival));
}

std::vector<Rival> Rivals::of(const EffectFinding& found, std::size_t term) {
  const ModelFit& less = selection_.without({term, std::nullopt});
  const std::vector<std::string> alike = confused_with(*found.candidate, candidates_);
  std::vector<Rival> rivals;
  const auto compare = [&](const Candidate& candidate, ModelFit fit) {
    if (std::optional<Rival> rival = compared(less, candidate, {found.name}, std::move(fit)))
      put(rivals, *std::move(rival));
  };
  for (Trial& trial : trials_.best(less, found.candidate, settings.min_rival_gain, alike))
    compare(trial.candidate->root(), std::move(trial.fit));
  // A map of the pixels is equal in all conditions, like some effects of the setup: a tilt, at a single distance.
  const bool of_set_up = found.candidate->border().scope == TOFGRAPH_SCOPE_SETUP && problem_.design.superpixels() > 1;
  for (const auto& candidate : candidates_) {
    const bool asked = of_set_up && contains(alike, candidate->name());
    if (!asked || candidate->maps().empty() || is_in(less.state, *candidate)) continue;
    try {
      compare(*candidate, fit_with_map_of(problem_, less.state, *candidate));
    } catch (const simulation::EffectError&) {  // the effect fails
    }
  }
  // Effects listed as confused may be so only in another form, or together with other maps.
  for (const auto& candidate : candidates_) {
    if (!contains(alike, candidate->name())) continue;
    const auto known = std::ranges::find(rivals, candidate.get(), &Rival::candidate);
    const bool tied = known != rivals.end() && known->tied;
    if (tied || (candidate->refinements().empty() && !has_maps(less.state))) continue;
    put_in_place(*candidate, found, term, less, rivals);
  }
  std::ranges::stable_sort(rivals, {}, &Rival::bic);
  return rivals;
}

std::vector<Rival> Rivals::among(const std::vector<std::string>& names, const EffectFinding& found, std::size_t term) {
  const ModelFit& less = selection_.without({term, std::nullopt});
  const std::vector<std::string> alike = confused_with(*found.candidate, candidates_);
  std::vector<Rival> rivals;
  for (const auto& candidate : candidates_) {
    if (contains(alike, candidate->name()) && contains(names, candidate->name()))
      put_in_place(*candidate, found, term, less, rivals);
  }
  return rivals;
}

/// Identifiability of a rival with a nonlinear parameter other than an angle; empty for other rivals.
Unidentified Rivals::nonlinear_identifiability(const ModelFit& fit, const Candidate& candidate) const {
  const std::size_t term = term_of(fit.state, candidate);
  const auto may_be_anything = [](const FreeParameter& p) { return p.nonlinear && !p.is_angle(); };
  if (term == fit.state.terms.size() || std::ranges::none_of(fit.state.terms[term].candidate->free(), may_be_anything))
    return {};
  return identifiability_of(problem_, with_jacobian(problem_, fit), term, seed_);
}

/// Message on the first nonlinear parameter that is near its limit, if the rival explains as much at the limit itself;
/// else "".
std::string Rivals::limit_reached(const ModelFit& fit, const Candidate& candidate) const {
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
      if (deviance_of(problem_, end) - deviance_of(problem_, fit.state) < settings.tie_limit) return limit;
    } catch (const simulation::EffectError&) {  // the effect fails at the limit
    }
    term.values[k] = here;
  }
  return "";
}

/// Rival in place of all of these terms, if it explains as much. @param terms ascending
std::optional<Rival> Rivals::in_place_of_all(const Candidate& candidate, const std::vector<std::size_t>& terms) {
  ModelFit less = selection_.best();
  std::vector<std::string> names;
  for (const std::size_t term : terms) names.push_back(selection_.terms()[term].candidate->name());
  std::vector<Rival> rivals;
  try {
    for (auto term = terms.rbegin(); term != terms.rend(); ++term)
      less = fit_without(problem_, less, {*term, std::nullopt});
    for (ModelFit& fit : selection_.forms_of(less, candidate))
      if (std::optional<Rival> rival = compared(less, candidate, names, std::move(fit))) put(rivals, *std::move(rival));
  } catch (const simulation::EffectError&) {  // an effect fails
  }
  return !rivals.empty() && rivals.front().does_as_much() ? std::optional(std::move(rivals.front())) : std::nullopt;
}

void Rivals::add_of_several(std::vector<EffectFinding>& all, std::size_t first_term) {
  const auto stands_for_several = [](const EffectFinding& found) {
    return std::ranges::any_of(found.rivals, [](const Rival& one) { return one.tied && one.of_several(); });
  };
  for (const auto& candidate : candidates_) {
    if (candidate->amplitudes() == 0 || !candidate->maps().empty() || is_in(selection_.best().state, *candidate))
      continue;
    const std::vector<std::string> alike = confused_with(*candidate, candidates_);
    std::vector<std::size_t> terms;
    for (std::size_t f = 0; f < all.size(); ++f) {
      if (contains(alike, all[f].name) && !stands_for_several(all[f])) terms.push_back(first_term + f);
    }
    if (terms.size() < 2) continue;
    std::optional<Rival> rival;  // a tied one, else one that explains as much
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
