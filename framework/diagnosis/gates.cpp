// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/gates.hpp"

#include "diagnosis/maps.hpp"
#include "diagnosis/validation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

constexpr double least_beyond_wandering = 12;  ///< chi-square: one in two thousand by chance
constexpr double least_capture = 0.8;          ///< of the gain of the best generic pattern in the complete model
/// What a camera may do that wanders slowly while the conditions are measured: half waves over the order measured, the
/// constant first. @param change of a row for a unit of it
template <class Change> Group wandering(const Problem& problem, const char* name, Change change) {
  const std::vector<io::Condition>& conditions = problem.design.conditions();
  double last = 1;
  for (const io::Condition& c : conditions) last = std::max(last, static_cast<double>(c.order.value_or(0)));
  Group group{name, {}};
  const std::size_t waves = std::min<std::size_t>(8, conditions.size() / 6);
  for (std::size_t wave = 0; wave <= waves; ++wave) {
    Column& column = group.columns.emplace_back(conditions.size(), std::vector<double>(problem.design.rows()));
    for (std::size_t i = 0; i < conditions.size(); ++i) {
      const double place = static_cast<double>(conditions[i].order.value_or(0)) / last;
      const double height = std::cos(static_cast<double>(wave) * std::numbers::pi * place);
      for (std::size_t row = 0; row < column[i].size(); ++row) column[i][row] = height * change(i, row);
    }
  }
  return group;
}

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
      held_(hold_out(problem.design, seed)) {
  if (!std::ranges::all_of(problem.design.conditions(), [](const io::Condition& c) { return c.order.has_value(); }))
    return;
  const auto offset = [&](std::size_t, std::size_t row) {
    return row / problem.design.superpixels() == distance ? 1e-3 : 0;
  };
  const auto light = [&](std::size_t i, std::size_t row) { return 1e-2 * problem.light_response(i, row); };
  wanderings_ = {wandering(problem, "distance", offset), wandering(problem, "light", light)};
}

bool Gates::significant(const Score& score) {
  return score.p_value < significance || (score.carriers < few && score.gain - score.dimension > certain);
}

bool Gates::worth_a_name(const Column& change) const { return importance(problem_, change) > 1; }

bool Gates::beyond_wandering(const Fit& best, const Base& less, const Group& change) const {
  std::vector<Column> own = less.columns;
  std::vector<Column> all = own;
  all.push_back(change.columns[0]);
  for (const Group& wandering : wanderings_) {
    const Group moving{wandering.name, {wandering.columns.begin() + 1, wandering.columns.end()}};
    const Group* const only = &moving;
    if (significant(scan(problem_, best, all, std::span(&only, 1), flips_, seed_).scores[0]))
      std::ranges::copy(wandering.columns, std::back_inserter(own));
  }
  if (own.size() == less.columns.size()) return true;
  // A camera that wanders may do so about any mean: what the change brings beside all that.
  Fit without = less.fit;
  without.state.variances = best.state.variances;
  const InLightOf there(problem_, less);
  const Group* const only = &change;
  return scan(problem_, without, own, std::span(&only, 1), 0, 0).scores[0].gain > least_beyond_wandering;
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
  found.gain = less.fit.deviance - best.fit.deviance;
  const Group group{term.candidate->name(), signature(problem_, less.fit.state, term)};
  // The one direction that was fitted; among all directions of all candidates it has been chosen when it was added.
  const Group direction{group.name, {group.columns[0]}};
  const bool wanders = !term.maps && !beyond_wandering(best.fit, less, direction);
  const InLightOf there(problem_, less);
  const Group* const only = &direction;
  const Score score = term.maps ? score_of_maps(problem_, less, term, flips_, seed_)
                                : scan(problem_, less.fit, less.columns, std::span(&only, 1), flips_, seed_).scores[0];
  found.p_value = score.p_value;
  found.capture = capture(less, group);
  if (!significant(score)) {
    found.refutation = fmt::format("chance may do as much (p = {:.3f})", found.p_value);
  } else if (wanders) {
    found.refutation = "the camera wanders while the conditions are measured, and that may do as much";
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
