// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/rivals.hpp"

#include "diagnosis/contribution.hpp"
#include "diagnosis/told.hpp"
#include "diagnosis/validation.hpp"

#include <algorithm>

namespace tofgraph::diagnosis {
namespace {

constexpr double tie_limit = 10;       ///< of deviance or BIC
constexpr double rival_share = 0.5;    ///< of the best linear gain, to be fitted in the place of one that was found
constexpr double close_behind = 0.01;  ///< of a gain: rivals that are settled by every pixel, as the best one was

void put(std::vector<Rival>& rivals, Rival rival) {
  const auto known = std::ranges::find(rivals, rival.candidate, &Rival::candidate);
  if (known == rivals.end())
    rivals.push_back(std::move(rival));
  else if (rival.bic < known->bic)
    *known = std::move(rival);
}

}  // namespace

Rival Rivals::compared(const Candidate& candidate, std::vector<std::string> in_place_of, Fit fit) const {
  const Fit& best = selection_.best().fit;
  Rival rival{&candidate.root(), std::move(in_place_of), fit.deviance - best.deviance,
              selection_.bic(fit) - selection_.bic(best)};
  rival.tied =
      std::min(rival.deviance, rival.bic) < tie_limit || hardly_differ(problem_, best.state, fit.state, tie_limit);
  rival.state = std::move(fit.state);
  return rival;
}

std::vector<Rival> Rivals::of(const Found& found, std::size_t term) const {
  const Base& less = selection_.without({term, std::nullopt});
  const InLightOf there(problem_, less);
  const double gain = less.fit.deviance - selection_.best().fit.deviance;
  const std::vector<std::string> alike = confused_with(*found.candidate, candidates_);
  std::vector<Rival> rivals;
  const auto compare = [&](const Candidate& candidate, Fit fit) {
    if (!(fit.deviance < less.fit.deviance)) return;
    const double behind = fit.deviance - selection_.best().fit.deviance;
    if (behind > tie_limit && behind < close_behind * gain) {  // by every pixel, or as it is where it cannot do them
      try {
        fit = selection_.settled(fit.state);
      } catch (const simulation::EffectError&) {
      }
    }
    put(rivals, compared(candidate, {found.name}, std::move(fit)));
  };
  for (Trial& trial : trials_.best(less, found.candidate, rival_share, alike))
    compare(*trial.candidate, std::move(trial.fit));
  // What is said to be like it may be so in another form alone, or with other maps beside it.
  for (const auto& candidate : candidates_) {
    if (std::ranges::find(alike, candidate->name()) == alike.end()) continue;
    const auto known = std::ranges::find(rivals, candidate.get(), &Rival::candidate);
    const bool tied = known != rivals.end() && known->tied;
    if (tied || (candidate->refinements().empty() && !has_maps(less.fit.state))) continue;
    if (std::optional<Fit> fit = selection_.with(less, *candidate)) compare(*candidate, std::move(*fit));
  }
  std::ranges::stable_sort(rivals, {}, &Rival::bic);
  return rivals;
}

/// The first of its shapes that these data do not tell.
std::optional<std::size_t> Rivals::untold_shape(const Fit& fit, const Candidate& candidate) const {
  const double rest = left_of(problem_, fit, own_columns(problem_, fit.state, expected(problem_, fit.state)));
  const std::vector<Interval> values = intervals(problem_, fit, seed_, rest, Refinements::as_they_are);
  for (std::size_t t = 0; t < fit.state.terms.size(); ++t) {
    if (&fit.state.terms[t].candidate->root() == &candidate) return silence_of(fit, t, values, rest).shape;
  }
  return std::nullopt;
}

/// @param terms ascending @returns what is tied
std::optional<Rival> Rivals::of_these(const Candidate& candidate, const std::vector<std::size_t>& terms) const {
  Base less = selection_.best();
  std::vector<std::string> names;
  for (const std::size_t term : terms) names.push_back(selection_.terms()[term].candidate->name());
  try {
    for (auto term = terms.rbegin(); term != terms.rend(); ++term)
      less = without(problem_, less, {*term, std::nullopt}, selection_.weight());
    const InLightOf there(problem_, less);
    const std::optional<Fit> fit = selection_.with(less, candidate);
    if (!fit) return std::nullopt;
    Rival rival = compared(candidate, std::move(names), *fit);
    if (!rival.tied) return std::nullopt;
    rival.untold = untold_shape(*fit, candidate);
    return rival;
  } catch (const simulation::EffectError&) {  // it gives no number there
    return std::nullopt;
  }
}

void Rivals::add_of_several(std::vector<Found>& all, std::size_t first_term) const {
  for (const auto& candidate : candidates_) {
    if (candidate->sizes() == 0 || !candidate->maps().empty() || is_in(selection_.best().fit.state, *candidate))
      continue;
    const std::vector<std::string> alike = confused_with(*candidate, candidates_);
    std::vector<std::size_t> terms;
    for (std::size_t f = 0; f < all.size(); ++f) {
      const auto told = std::ranges::find(all[f].rivals, candidate.get(), &Rival::candidate);
      if (told != all[f].rivals.end() && told->of_several()) break;  // it stood there before
      if (std::ranges::find(alike, all[f].name) != alike.end()) terms.push_back(first_term + f);
    }
    if (terms.size() < 2) continue;
    const std::optional<Rival> rival = of_these(*candidate, terms);
    if (!rival) continue;
    for (const std::size_t term : terms) {
      std::vector<Rival>& rivals = all[term - first_term].rivals;
      std::erase_if(rivals, [&](const Rival& one) { return one.candidate == candidate.get(); });
      rivals.insert(rivals.begin(), *rival);
    }
  }
}

}  // namespace tofgraph::diagnosis
