// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/gates.hpp"

#include "diagnosis/maps.hpp"
#include "diagnosis/validation.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

constexpr double least_capture = 0.8;  ///< of the gain of the best generic pattern in the complete model
/// What an effect must change in one condition at least, root mean square of an observable: less is within what a
/// simulation on a grid and a camera's repeatability leave open, however sure it is.
constexpr std::array<double, observables> practical = {1e-4, 1e-3, 1e-3, 2e-4, 2e-4};  // m, others relative

}  // namespace

InLightOf::InLightOf(Problem& problem, const Base& base)
    : problem_(problem), before_(std::exchange(problem.brightening, base.brightening)) {}

Gates::Gates(Problem& problem, const PatternFinder& finder, std::span<const double> weight, std::size_t flips,
             std::uint64_t seed)
    : problem_(problem),
      finder_(finder),
      weight_(weight),
      flips_(flips),
      seed_(seed),
      held_(hold_out(problem.design, seed)) {}

bool Gates::significant(const Score& score) {
  return score.p_value < significance || (score.carriers < few && score.gain - score.dimension > certain);
}

bool Gates::worth_a_name(const Column& change) const {
  const std::size_t n = problem_.design.superpixels();
  for (std::size_t i = 0; i < change.size(); ++i) {
    for (std::size_t o = 0; o < observables; ++o) {
      double sum = 0, count = 0;
      for (std::size_t row = o * n; row < (o + 1) * n; ++row) {
        if (std::isinf(problem_.data[i].variance[row])) continue;
        sum += change[i][row] * change[i][row];
        ++count;
      }
      if (count > 0 && std::sqrt(sum / count) > practical[o]) return true;
    }
  }
  return false;
}

double Gates::capture(const Base& less, const Group& group) const {
  const Group* const only = &group;
  const double gain = scan(problem_, less.fit, less.columns, std::span(&only, 1), 0, 0).scores[0].gain;
  const double most = finder_.find(problem_, less.fit, less.columns, 0, 0).most;
  return most > 0 ? gain / most : std::numeric_limits<double>::infinity();
}

Base Gates::without(const Base& best, std::size_t term) const {
  Base less{{}, best.columns, {}};
  State state = best.fit.state;
  std::size_t first = 0;
  for (std::size_t t = 0; t < term; ++t) first += state.terms[t].values.size();
  const auto at = less.columns.begin() + static_cast<std::ptrdiff_t>(first);
  less.columns.erase(at, at + static_cast<std::ptrdiff_t>(state.terms[term].values.size()));
  state.terms.erase(state.terms.begin() + static_cast<std::ptrdiff_t>(term));
  Problem dimmed = problem_;
  brighten(dimmed, state);
  less.fit = fit_last(dimmed, std::move(state), weight_, less.columns);
  if (has_maps(less.fit.state))
    less.fit = fit_with_maps(dimmed, less.fit.state, weight_);  // maps take over what they can
  less.brightening = std::move(dimmed.brightening);
  return less;
}

Found Gates::examined(const Base& best, std::size_t t) {
  const Term& term = best.fit.state.terms[t];
  Found found;
  found.candidate = term.candidate;
  const Base less = without(best, t);
  found.held_out = held_out_fall(problem_, best.fit.state, less.fit.state, held_, seed_);
  const InLightOf there(problem_, less);
  found.gain = less.fit.deviance - best.fit.deviance;
  const Group group{term.candidate->name(), signature(problem_, less.fit.state, term)};
  // The one direction that was fitted; among all directions of all candidates it has been chosen when it was added.
  const Group direction{group.name, {group.columns[0]}};
  const Group* const only = &direction;
  const Score score = term.maps ? score_of_maps(problem_, less, term, flips_, seed_)
                                : scan(problem_, less.fit, less.columns, std::span(&only, 1), flips_, seed_).scores[0];
  found.p_value = score.p_value;
  found.capture = capture(less, group);
  if (!significant(score)) {
    found.refutation = fmt::format("chance may do as much (p = {:.3f})", found.p_value);
  } else if (!worth_a_name(group.columns[0])) {
    found.refutation = too_small;
  } else if (found.capture < least_capture) {
    found.refutation = fmt::format("it explains {:.0f} % of what a pattern without physics does", 100 * found.capture);
  } else {
    found.refutation = refuted(found.held_out);
  }
  return found;
}

}  // namespace tofgraph::diagnosis
