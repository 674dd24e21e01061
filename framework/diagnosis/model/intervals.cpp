// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/intervals.hpp"

#include "diagnosis/data/search_settings.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

namespace tofgraph::diagnosis {

namespace {

/// Refinement that a term does not have, and the changes by its size, each for a typical value.
struct Unseen {
  std::size_t term, refinement;
  std::vector<double> off;
  std::vector<Column> columns;  ///< two where it has an angle, which may be anything: both quadratures
};

/// @param rows expected(problem, state)
std::vector<Unseen> unseen_refinements(const Problem& problem, const State& state, const Rows& rows) {
  std::vector<Unseen> all;
  for (std::size_t t = 0; t < state.terms.size(); ++t) {
    const Candidate& candidate = *state.terms[t].candidate;
    for (std::size_t r = 0; r < candidate.refinements().size(); ++r) {
      if (candidate.refined(r)) continue;
      Unseen one{t, r, {}, {}};
      std::vector<double> quarter;
      for (const FreeParameter& p : candidate.refinements()[r].parameters) {
        one.off.push_back(p.off);
        quarter.push_back(p.nonlinear && p.is_angle() ? p.off + std::numbers::pi / 2 : p.off);
      }
      const auto add = [&](const std::vector<double>& values) {
        State open = state;
        open.terms[t] = refined(open.terms[t], r, values);
        one.columns.push_back(derivative(problem, open, rows, t, open.terms[t].candidate->place(r)));
      };
      add(one.off);
      if (quarter != one.off) add(quarter);
      all.push_back(std::move(one));
    }
  }
  return all;
}

/// Distance of a size from off in standard deviations of its likelihood alone. @param value estimated with the prior
/// @param variance likewise, in units of the prior's
double deviations(double value, double variance) {
  return std::abs(value) / std::sqrt(std::max(variance * std::pow(1 - variance, 2), 1e-30));
}

/// Widens the intervals of a term's values to those of the fit with one more refinement.
/// @param wider factor for lack of fit @param first index of the interval of the term's first value
/// @throws simulation::EffectError
void widen(const Problem& problem, const ModelFit& fit, const Unseen& unseen, double wider, std::size_t first,
           std::vector<Interval>& all) {
  State open = fit.state;
  Term& term = open.terms[unseen.term];
  if (term.maps) return;  // the product alone is known
  term = refined(std::move(term), unseen.refinement, unseen.off);
  const std::size_t place = term.candidate->place(unseen.refinement);
  const std::vector<double> weight(problem.data.size(), 1.0);
  const ModelFit more = fit_roughly(problem, std::move(open), weight);
  const Term& there = more.state.terms[unseen.term];
  for (std::size_t k = 0; k < fit.state.terms[unseen.term].values.size(); ++k) {
    const std::size_t at = k < place ? k : k + unseen.off.size();
    const FreeParameter& p = there.candidate->free()[at];
    if (p.is_angle()) continue;  // it may have gone round
    const auto j = static_cast<Eigen::Index>(first + at);
    const double half = wider * 1.96 * std::abs(p.typical) * std::sqrt(more.covariance(j, j));
    Interval& interval = all[first + k];
    interval.low = std::max(std::min(interval.low, there.values[at] - half), p.minimum);
    interval.high = std::min(std::max(interval.high, there.values[at] + half), p.maximum);
  }
}

/// Widens intervals by refinements that show: what the linear problem says of these is right for small ones alone.
/// @param whole solution with their columns, which come after those of the fit
void widen_beyond_linear(const Problem& problem, const ModelFit& fit, const std::vector<Unseen>& unseen,
                         const Solution& whole, double lack_of_fit, std::vector<Interval>& all) {
  auto at = static_cast<Eigen::Index>(all.size());
  for (const Unseen& one : unseen) {
    double most = 0;
    for (std::size_t c = 0; c < one.columns.size(); ++c, ++at)
      most = std::max(most, deviations(whole.values(at), whole.covariance(at, at)));
    std::size_t first = 0;
    for (std::size_t t = 0; t < one.term; ++t) first += fit.state.terms[t].values.size();
    if (most <= settings.interval_refinement_sd) continue;
    try {
      widen(problem, fit, one, std::sqrt(std::max(lack_of_fit, 1.0)), first, all);
    } catch (const simulation::EffectError&) {  // with it the effect gives no number: the linear interval stays
    }
  }
}

}  // namespace

std::vector<Interval> intervals(const Problem& problem, const ModelFit& fit, std::uint64_t seed, double lack_of_fit,
                                Refinements refinements) {
  const auto rows = expected(problem, fit.state);
  std::vector<Column> columns = jacobian(problem, fit.state, rows);
  const std::size_t own = columns.size();
  std::vector<Unseen> unseen;
  if (refinements == Refinements::may_be_there) unseen = unseen_refinements(problem, fit.state, rows);
  for (const Unseen& one : unseen) std::ranges::copy(one.columns, std::back_inserter(columns));
  const Unknowns unknowns = problem.unknowns(columns.size());
  std::vector<Gram> grams = grams_of(problem, fit.state, rows, columns);
  std::vector<double> determinants(grams.size());
  for (std::size_t i = 0; i < grams.size(); ++i) grams[i] = marginal(grams[i], fit.state.random_sd, determinants[i]);
  const auto solved = [&](const std::vector<double>& weight) {
    NormalEquations equations = assemble(grams, determinants, unknowns, weight);
    for (auto j = static_cast<Eigen::Index>(own); j < unknowns.effects; ++j)
      equations.information(j, j) += 1;  // the prior of refinements
    return solve(equations, unknowns, fit.state.random_sd);
  };
  std::vector<double> weight(grams.size(), 1.0);
  const Solution whole = solved(weight);
  std::mt19937_64 generator(seed);
  std::vector<std::vector<double>> drawn(own);
  for (int d = 0; d < settings.interval_draws; ++d) {
    std::ranges::fill(weight, 0.0);
    for (std::size_t k = 0; k < grams.size(); ++k) ++weight[generator() % grams.size()];
    const Solution one = solved(weight);
    for (std::size_t c = 0; c < own; ++c) {
      const auto j = static_cast<Eigen::Index>(c);
      drawn[c].push_back(one.values(j) - whole.values(j));
    }
  }
  std::vector<Interval> result;
  std::size_t c = 0;
  for (const Term& term : fit.state.terms) {
    for (std::size_t k = 0; k < term.values.size(); ++k, ++c) {
      std::ranges::sort(drawn[c]);
      const auto j = static_cast<Eigen::Index>(c);
      const double likely = 1.96 * std::sqrt(whole.covariance(j, j));
      // Where unseen refinements would move a value, the interval is about both.
      const double moved = own < columns.size() ? whole.values(j) : 0;
      const double wider = std::sqrt(std::max(lack_of_fit, 1.0));
      const double below = wider * std::min(drawn[c][settings.interval_draws / 40], -likely) + std::min(moved, 0.0),
                   above =
                       wider * std::max(drawn[c][settings.interval_draws - 1 - settings.interval_draws / 40], likely) +
                       std::max(moved, 0.0);
      const double unit = term.candidate->free()[k].typical;
      const auto [low, high] = std::minmax({unit * below, unit * above});  // typical values may be below zero
      result.push_back({term.values[k] + low, term.values[k] + high});
    }
  }
  widen_beyond_linear(problem, fit, unseen, whole, lack_of_fit, result);
  return result;
}

}  // namespace tofgraph::diagnosis
