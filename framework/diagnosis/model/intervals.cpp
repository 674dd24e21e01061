// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/intervals.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/scan.hpp"

#include <fmt/format.h>
#include <boost/math/distributions/chi_squared.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace tofgraph::diagnosis {
namespace {

/// Refinement that a term does not have, and the changes by its amplitude, for one typical value.
struct Unseen {
  std::size_t term, refinement;
  std::vector<double> off;
  std::vector<Column> columns;  ///< two if it has an angle over the whole circle: both quadratures
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
        quarter.push_back(p.is_angle() ? p.off + std::numbers::pi / 2 : p.off);
      }
      const auto add = [&](const std::vector<double>& values) {
        State open = state;
        open.terms[t] = refined(open.terms[t], r, values);
        one.columns.push_back(derivative(problem, open, rows, t, open.terms[t].candidate->first_parameter_of(r)));
      };
      add(one.off);
      if (quarter != one.off) add(quarter);
      all.push_back(std::move(one));
    }
  }
  return all;
}

/// Distance of an amplitude from off in standard deviations of its likelihood alone. @param value with the prior
/// @param variance with the prior, in units of the prior's
double deviations(double value, double variance) {
  return std::abs(value) / std::sqrt(std::max(variance * std::pow(1 - variance, 2), 1e-30));
}

/// Widens the intervals of a term's values to include those of the fit with one more refinement.
/// @param wider factor for lack of fit @param first index of the interval of the term's first value
/// @throws simulation::EffectError
void widen(const Problem& problem, const ModelFit& fit, const Unseen& unseen, double wider, std::size_t first,
           std::vector<Interval>& all) {
  State open = fit.state;
  Term& term = open.terms[unseen.term];
  if (term.maps) return;  // only scale times map is determined
  term = refined(std::move(term), unseen.refinement, unseen.off);
  const std::size_t place = term.candidate->first_parameter_of(unseen.refinement);
  const ModelFit more = fit_roughly(problem, std::move(open));
  const Term& there = more.state.terms[unseen.term];
  for (std::size_t k = 0; k < fit.state.terms[unseen.term].values.size(); ++k) {
    const std::size_t at = k < place ? k : k + unseen.off.size();
    const FreeParameter& p = there.candidate->free()[at];
    if (p.is_angle()) continue;  // it may have made a full turn
    const auto j = static_cast<Eigen::Index>(first + at);
    const double half = wider * 1.96 * std::abs(p.typical) * std::sqrt(more.covariance(j, j));
    Interval& interval = all[first + k];
    interval.low = std::max(std::min(interval.low, there.values[at] - half), p.minimum);
    interval.high = std::min(std::max(interval.high, there.values[at] + half), p.maximum);
  }
}

/// Widens intervals by noticeable refinements, for which the linear problem is too inaccurate.
/// @param whole solution that includes their columns, after those of the fit
void widen_beyond_linear(const Problem& problem, const ModelFit& fit, const std::vector<Unseen>& unseen,
                         const Solution& whole, double lack_of_fit, std::vector<Interval>& all) {
  auto at = static_cast<Eigen::Index>(all.size());
  for (const Unseen& one : unseen) {
    double most = 0;
    for (std::size_t c = 0; c < one.columns.size(); ++c, ++at)
      most = std::max(most, deviations(whole.values(at), whole.covariance(at, at)));
    if (most <= settings.interval_refinement_sd) continue;
    try {
      widen(problem, fit, one, std::sqrt(std::max(lack_of_fit, 1.0)), first_parameter(fit.state, one.term), all);
    } catch (const simulation::EffectError&) {  // undefined with this refinement: the linear interval stays
    }
  }
}

/// True if the joint confidence region of some parameters, whatever the others are, contains their off values. The
/// conditions may determine only differences of parameters, such as the gains of four samples without known light: then
/// each single interval is wide.
/// @param from distances from off, in typical values @param at indices in the covariance
bool consistent_with_off(const ModelFit& fit, const std::vector<double>& from, const std::vector<Eigen::Index>& at,
                         double lack_of_fit) {
  const auto n = static_cast<Eigen::Index>(at.size());
  const Eigen::MatrixXd covariance = fit.covariance(at, at);
  const Eigen::VectorXd distance = Eigen::Map<const Eigen::VectorXd>(from.data(), n);
  const double square = distance.dot(covariance.ldlt().solve(distance)) / std::max(lack_of_fit, 1.0);
  return square < boost::math::quantile(boost::math::chi_squared(static_cast<double>(n)), settings.joint_confidence);
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
  const std::vector<double> determinants = marginalise(grams, fit.state.random_sd);
  const auto solved = [&](const std::vector<double>& weight) {
    NormalEquations equations = assemble(grams, determinants, unknowns, weight);
    for (auto j = static_cast<Eigen::Index>(own); j < unknowns.effects; ++j)
      equations.information(j, j) += 1;  // prior of refinements
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
      // The interval covers the value with and without the change by missing refinements.
      const double moved = own < columns.size() ? whole.values(j) : 0;
      const double wider = std::sqrt(std::max(lack_of_fit, 1.0));
      const double below = wider * std::min(drawn[c][settings.interval_draws / 40], -likely) + std::min(moved, 0.0),
                   above =
                       wider * std::max(drawn[c][settings.interval_draws - 1 - settings.interval_draws / 40], likely) +
                       std::max(moved, 0.0);
      const double unit = term.candidate->free()[k].typical;
      const auto [low, high] = std::minmax({unit * below, unit * above});  // typical values may be negative
      result.push_back({term.values[k] + low, term.values[k] + high});
    }
  }
  widen_beyond_linear(problem, fit, unseen, whole, lack_of_fit, result);
  return result;
}

std::string limit_of(const FreeParameter& p, double value) {
  const double typical = std::abs(p.typical);
  const bool open = p.nonlinear && !p.is_angle() && p.maximum - p.minimum > settings.max_interval_width * typical;
  if (!open || value - p.minimum >= settings.near_limit * typical) return "";
  const std::string unit = p.unit.empty() ? "" : " " + p.unit;
  return fmt::format("its {} reached its limit ({:.3g}{}, at least {:.3g}{})", p.name, value, unit, p.minimum, unit);
}

Unidentified identifiability_of(const ModelFit& fit, std::size_t term, std::span<const Interval> all,
                                double lack_of_fit) {
  const Term& one = fit.state.terms[term];
  if (one.maps) return {};
  const std::size_t first = first_parameter(fit.state, term);
  bool off = true;
  std::vector<double> from;
  std::vector<Eigen::Index> at;
  for (std::size_t k = 0; k < one.values.size(); ++k) {
    const FreeParameter& p = one.candidate->free()[k];
    const Interval& interval = all[first + k];
    const double width = interval.high - interval.low;
    if (!p.nonlinear) {
      off = off && interval.low <= p.off && p.off <= interval.high;
      from.push_back((one.values[k] - p.off) / p.typical);
      at.push_back(static_cast<Eigen::Index>(first + k));
    } else if (!p.is_angle() && width > settings.max_interval_width * std::abs(p.typical)) {
      return {fmt::format("these conditions do not determine its {}", p.name), k};
    } else if (std::string limit = limit_of(p, one.values[k]);
               !limit.empty() && width > settings.max_width_at_limit * std::abs(p.typical)) {
      return {std::move(limit), k, true};
    }
  }
  if (!off || !consistent_with_off(fit, from, at, lack_of_fit)) return {};
  return {"none of its amplitudes differs significantly from zero", std::nullopt};
}

Unidentified identifiability_of(const Problem& problem, const ModelFit& fit, std::size_t term, std::uint64_t seed) {
  const double rest = lack_of_fit(problem, fit);
  return identifiability_of(fit, term, intervals(problem, fit, seed, rest, Refinements::as_they_are), rest);
}

ParameterStatus parameter_status(const FreeParameter& p, const Interval& interval, double variance) {
  const double width = interval.high - interval.low;
  const bool any_angle = p.is_angle() && width >= 2 * std::numbers::pi;
  const bool any_value = interval.low <= p.minimum && interval.high >= p.maximum;
  if (variance >= settings.prior_width * settings.prior_width / 2 || any_angle || any_value)
    return ParameterStatus::not_determined;
  if (!p.nonlinear && interval.low <= p.off && p.off <= interval.high) return ParameterStatus::consistent_with_zero;
  return ParameterStatus::determined;
}

}  // namespace tofgraph::diagnosis
