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
/// Half waves over the order measured, which together make what wanders slowly: so many at most, and so many conditions
/// for each at least.
constexpr std::size_t most_waves = 8, conditions_a_wave = 6;

/// The constant, then the half waves, one value a condition; nothing where the order is not told of all.
std::vector<std::vector<double>> waves_of(const Design& design) {
  if (!design.tells_order()) return {};
  const std::vector<io::Condition>& conditions = design.conditions();
  const auto [first, last] = std::ranges::minmax(conditions, {}, [](const io::Condition& c) { return *c.order; });
  const auto whole = static_cast<double>(*last.order - *first.order);
  std::vector<std::vector<double>> waves;
  const std::size_t count = whole > 0 ? std::min(most_waves, conditions.size() / conditions_a_wave) : 0;
  for (std::size_t wave = 0; count > 0 && wave <= count; ++wave) {
    waves.emplace_back();
    for (const io::Condition& c : conditions) {
      const double place = static_cast<double>(*c.order - *first.order) / whole;
      waves.back().push_back(std::cos(static_cast<double>(wave) * std::numbers::pi * place));
    }
  }
  return waves;
}

/// Columns of the waves. @param change of a row for a height of 1
template <class Change>
std::vector<Column> columns_of_waves(const std::vector<std::vector<double>>& waves, std::size_t rows, Change change) {
  std::vector<Column> columns;
  for (const std::vector<double>& wave : waves) {
    Column& column = columns.emplace_back(wave.size(), std::vector<double>(rows));
    for (std::size_t i = 0; i < wave.size(); ++i) {
      for (std::size_t row = 0; row < rows; ++row) column[i][row] = wave[i] * change(i, row);
    }
  }
  return columns;
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
      held_(hold_out(problem.design, seed)),
      waves_(waves_of(problem.design)) {}

bool Gates::beyond_wandering(const Fit& best, const Base& less, const Group& change) const {
  if (waves_.empty()) return true;
  const std::size_t n = problem_.design.superpixels(), rows = problem_.design.rows();
  // The same in all pixels: not quite what a board does that moves, which the waves can afford to tell apart.
  const auto offset = [n](std::size_t, std::size_t row) { return row / n == distance ? 1e-3 : 0; };
  const auto light = [&](std::size_t i, std::size_t row) { return 1e-2 * problem_.light_response(i, row); };
  std::vector<Column> own = less.columns, all = less.columns;
  all.push_back(change.columns[0]);
  for (const std::vector<Column>& wandering :
       {columns_of_waves(waves_, rows, offset), columns_of_waves(waves_, rows, light)}) {
    const Group moving{"wandering", {wandering.begin() + 1, wandering.end()}};
    if (significant(score_of(problem_, best, all, moving, flips_, seed_)))
      std::ranges::copy(wandering, std::back_inserter(own));
  }
  if (own.size() == less.columns.size()) return true;
  // A camera that wanders may do so about any mean: what the change brings beside all that.
  Fit without = less.fit;
  without.state.variances = best.state.variances;
  const InLightOf there(problem_, less);
  return score_of(problem_, without, own, change, 0, 0).gain > least_beyond_wandering;
}

double Gates::capture(const Base& less, const Group& group) const {
  const double gain = score_of(problem_, less.fit, less.columns, group, 0, 0).gain;
  const double most = finder_.find(problem_, less.fit, less.columns, 0, 0).most;
  return most > 0 ? gain / most : std::numeric_limits<double>::infinity();
}

Base Gates::without(const Base& best, const Piece& piece) const {
  Base less{{}, best.columns, {}};
  State state = best.fit.state;
  std::size_t first = 0;
  for (std::size_t t = 0; t < piece.term; ++t) first += state.terms[t].values.size();
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
  Problem dimmed = problem_;
  brighten(dimmed, state);
  less.fit = fit_last(dimmed, std::move(state), weight_, less.columns);
  if (has_maps(less.fit.state))
    less.fit = fit_with_maps(dimmed, less.fit.state, weight_);  // maps take over what they can
  less.brightening = std::move(dimmed.brightening);
  return less;
}

Found Gates::examined(const Base& best, const Piece& piece) {
  const Term& term = best.fit.state.terms[piece.term];
  Found found;
  found.candidate = term.candidate;
  found.name = name_of(term, piece);
  const Base less = without(best, piece);
  found.held_out = held_out_fall(problem_, best.fit.state, less.fit.state, held_, seed_);
  found.gain = less.fit.deviance - best.fit.deviance;
  const Group group{found.name, signature(problem_, less.fit.state, best.fit.state, piece)};
  // The one direction that was fitted; among all directions of all candidates it has been chosen when it was added.
  const Group direction{group.name, {group.columns[0]}};
  const bool wanders = !term.maps && !beyond_wandering(best.fit, less, direction);
  const InLightOf there(problem_, less);
  const Score score = term.maps ? score_of_maps(problem_, less, term, flips_, seed_)
                                : score_of(problem_, less.fit, less.columns, direction, flips_, seed_);
  found.p_value = score.p_value;
  found.capture = capture(less, group);
  if (!significant(score)) {
    found.refutation = fmt::format("chance may do as much (p = {:.3f})", found.p_value);
  } else if (wanders) {
    found.refutation = "the camera wanders while the conditions are measured, and that may do as much";
  } else if (importance(problem_, group.columns[0]) <= 1) {
    found.refutation = too_small;
  } else if (found.capture < least_capture) {
    found.refutation = fmt::format("it explains {:.0f} % of what a pattern without physics does", 100 * found.capture);
  } else {
    found.refutation = refuted(found.held_out);
  }
  return found;
}

}  // namespace tofgraph::diagnosis
