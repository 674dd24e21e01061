// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/trials.hpp"

#include "diagnosis/maps.hpp"
#include "graph/stream.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

constexpr std::size_t shortlist = 6;    ///< candidates that are fitted
constexpr std::size_t most_starts = 2;  ///< probes of one candidate that a fit begins from
constexpr double second_start = 0.5;    ///< of the best probe's gain
constexpr double hardly_moved = 0.02;   ///< in typical steps

}  // namespace

/// Where a fit begins: at the sizes that the score suggests; with those that it says nothing of at half their typical
/// value, as a size may need another one to show; and where the effect changes nothing.
std::vector<State> Trials::starts(const State& state, const Probe& probe, const Score& score) const {
  std::vector<double> guess = probe.values, other = guess;
  bool unmoved = false;
  for (std::size_t c = 0; c < probe.sizes.size(); ++c) {
    const std::size_t k = probe.sizes[c];
    const FreeParameter& p = probe.parameters()[k];
    const double share = score.values(static_cast<Eigen::Index>(c));
    guess[k] = other[k] = std::clamp(p.off + share * probe.steps[c], p.minimum, p.maximum);
    if (std::abs(share) > hardly_moved) continue;
    other[k] = p.off + probe.steps[c] / 2;
    unmoved = true;
  }
  std::vector<State> result = {probe.placed(state, guess)};
  if (unmoved) result.push_back(probe.placed(state, other));
  result.push_back(probe.placed(state, probe.values));
  return result;
}

Trial Trials::fitted(const Base& base, const Probe& probe, const Score& score) const {
  Trial result{probe.candidate, {}, score};
  const std::vector<State> all = starts(base.fit.state, probe, score);
  for (std::size_t s = 0; s < all.size(); ++s) {
    // The last is for where the others are beyond what the effect can do, or lead to a minimum that is none.
    if (s + 1 == all.size() && result.fit.deviance < base.fit.deviance) break;
    try {
      Fit next = fit_last(problem_, all[s], weight_, base.columns);
      if (next.deviance < result.fit.deviance) result.fit = std::move(next);
    } catch (const simulation::EffectError&) {
      continue;
    }
  }
  return result;
}

std::vector<Trial> Trials::best(const Base& base, const Candidate* except, double promising,
                                std::span<const std::string> always) const {
  std::vector<const Probe*> probes;
  std::vector<const Group*> groups;
  for (std::size_t p = 0; p < probes_.list.size(); ++p) {
    const Probe& probe = probes_.list[p];
    if (is_in(base.fit.state, *probe.candidate) || probes_.refused.contains(probe.candidate->name())) continue;
    probes.push_back(&probe);
    groups.push_back(&probes_.groups[p]);
  }
  if (groups.empty()) return {};
  const Scan scanned = scan(problem_, base.fit, base.columns, groups, 0, 0);
  std::vector<std::size_t> ranked(probes.size());
  for (std::size_t i = 0; i < ranked.size(); ++i) ranked[i] = i;
  const double price = std::log(static_cast<double>(problem_.data.size()));
  const auto merit = [&](std::size_t i) { return scanned.scores[i].gain - scanned.scores[i].dimension * price; };
  std::ranges::stable_sort(ranked, std::greater<>{}, merit);
  const double most = scanned.scores[ranked.front()].gain;
  std::vector<Trial> result;
  std::map<const Candidate*, std::pair<std::size_t, double>> tried;  // starts, and the first one's gain
  for (const std::size_t i : ranked) {
    const Probe& probe = *probes[i];
    const Score& score = scanned.scores[i];
    const bool asked = std::ranges::find(always, probe.candidate->name()) != always.end();
    const bool out = except != nullptr && &probe.candidate->root() == &except->root();
    if (out || (!asked && score.gain < promising * most)) continue;
    if (!asked && !tried.contains(probe.candidate) && tried.size() >= shortlist) continue;
    auto& [starts, first_gain] = tried.try_emplace(probe.candidate, 0, score.gain).first->second;
    const bool again = starts > 0 && score.gain > 0.999 * first_gain;  // an angle half a turn on, with the other sign
    if (starts == most_starts || again || score.gain < second_start * first_gain) continue;
    ++starts;
    Trial trial = fitted(base, probe, score);
    if (!std::isfinite(trial.fit.deviance)) continue;
    const auto before = std::ranges::find(result, probe.candidate, &Trial::candidate);
    if (before == result.end())
      result.push_back(std::move(trial));
    else if (trial.fit.deviance < before->fit.deviance)
      before->fit = std::move(trial.fit);
  }
  std::ranges::stable_sort(result, {}, [&](const Trial& t) { return t.fit.bic(problem_.data.size()); });
  return result;
}

Base without(const Problem& problem, const Base& best, const Piece& piece, std::span<const double> weight) {
  Base less{{}, best.columns, {}};
  State state = best.fit.state;
  std::size_t first = first_parameter(state, piece.term);
  const auto term = state.terms.begin() + static_cast<std::ptrdiff_t>(piece.term);
  const std::size_t count = values_of(*term, piece).size();
  if (piece.refinement) {
    first += term->candidate->place(*piece.refinement);
    *term = coarser(std::move(*term), *piece.refinement);
  } else {
    state.terms.erase(term);
  }
  const auto at = less.columns.begin() + static_cast<std::ptrdiff_t>(first);
  less.columns.erase(at, at + static_cast<std::ptrdiff_t>(count));
  Problem dimmed = problem;
  brighten(dimmed, state);
  less.fit = fit_last(dimmed, std::move(state), weight, less.columns);
  if (has_maps(less.fit.state))
    less.fit = fit_with_maps(dimmed, less.fit.state, weight);  // maps take over what they can
  less.brightening = std::move(dimmed.brightening);
  return less;
}

InLightOf::InLightOf(Problem& problem, const Base& base)
    : problem_(problem), before_(std::exchange(problem.brightening, base.brightening)) {}

std::vector<std::string> confused_with(const Candidate& one,
                                       const std::vector<std::unique_ptr<Candidate>>& candidates) {
  std::vector<std::string> names = graph::split_words(one.border().confused_with);
  for (const auto& other : candidates) {
    const std::vector<std::string> theirs = graph::split_words(other->border().confused_with);
    if (std::ranges::find(theirs, one.name()) != theirs.end()) names.push_back(other->name());
  }
  return names;
}

}  // namespace tofgraph::diagnosis
