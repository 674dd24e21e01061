// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/fit.hpp"

#include "diagnosis/data/search_settings.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

double of_maps(const State& state) {
  double dimension = 0;
  for (const Term& term : state.terms) dimension += term.maps ? term.maps->dimension() : 0;
  return dimension;
}

double turned_by(const FreeParameter& p, double value, double angle) {
  const double next = value + angle;
  return next - 2 * std::numbers::pi * std::floor((next - p.minimum) / (2 * std::numbers::pi));
}

/// Value of a parameter after a step in its unit: within bounds, and with a short step for nonlinear parameters.
double moved(const FreeParameter& p, double value, double step) {
  if (p.is_angle()) {
    return turned_by(p, value, std::clamp(step, -0.7, 0.7));
  }
  if (p.nonlinear) {
    const double most = 0.5 * std::max(std::abs(value), 0.1 * std::abs(p.typical));
    step = std::clamp(step, -most, most);
  }
  return std::clamp(value + step, p.minimum, p.maximum);
}

State stepped(const Problem& problem, const State& from, const Eigen::VectorXd& step, double share, bool effects) {
  State to = from;
  Eigen::Index j = 0;
  for (std::size_t t = 0; effects && t < to.terms.size(); ++t) {
    const auto& free = to.terms[t].candidate->free();
    for (std::size_t k = 0; k < free.size(); ++k, ++j)
      to.terms[t].values[k] = moved(free[k], to.terms[t].values[k], share * step(j) * free[k].typical);
  }
  for (std::size_t t = 0; t < problem.targets.size(); ++t) to.log_reflectivity[t] += share * step(j++);
  return to;
}

/// Least-squares step in which parameters at a bound do not move beyond it.
Eigen::VectorXd within_bounds(const Problem& problem, const State& state, const std::vector<Column>& columns,
                              const Rows& rows, const Profile& free) {
  Eigen::VectorXd step = free.solution.values;
  std::vector<Eigen::Index> kept;
  Eigen::Index j = 0;
  for (const Term& term : state.terms) {
    for (std::size_t k = 0; k < term.values.size(); ++k, ++j) {
      const FreeParameter& p = term.candidate->free()[k];
      const double change = step(j) * p.typical, value = term.values[k];
      if (!p.is_angle() && ((value >= p.maximum && change > 0) || (value <= p.minimum && change < 0))) continue;
      kept.push_back(j);
    }
  }
  if (kept.size() == columns.size()) return step;
  std::vector<Column> inside;
  for (const Eigen::Index c : kept) inside.push_back(columns[static_cast<std::size_t>(c)]);
  const Eigen::VectorXd less =
      profile(grams_of(problem, state, rows, inside), problem.unknowns(inside.size()), free.random_sd).solution.values;
  step.head(j).setZero();
  for (std::size_t c = 0; c < kept.size(); ++c) step(kept[c]) = less(static_cast<Eigen::Index>(c));
  const Eigen::Index rest = less.size() - static_cast<Eigen::Index>(kept.size());
  step.tail(rest) = less.tail(rest);
  return step;
}

/// Fit of reflectivities (linear) and variances at the given effects, all in profile().
ModelFit fit_linear_at(const Problem& problem, State state, const RandomEffectSd& random_sd) {
  // Without amplitudes reflectivities are nonlinear: they are updated with the steps of the effects.
  const bool linear = problem.light_seen();
  const std::vector<int> none(problem.target.size(), -1);
  Unknowns unknowns = problem.unknowns(0);
  if (!linear) unknowns.target = none, unknowns.targets = 0;
  const Profile after = profile(grams_of(problem, state, expected(problem, state), {}), unknowns, random_sd);
  for (std::size_t t = 0; linear && t < state.log_reflectivity.size(); ++t)
    state.log_reflectivity[t] += after.solution.values(static_cast<Eigen::Index>(t));
  state.random_sd = after.random_sd;
  return {std::move(state), after.solution.deviance, 0, {}};
}

/// A state with its amplitudes halfway to off.
State faded(State state) {
  for (Term& term : state.terms) {
    for (std::size_t k = 0; k < term.values.size(); ++k) {
      const FreeParameter& p = term.candidate->free()[k];
      if (!p.nonlinear) term.values[k] = p.off + (term.values[k] - p.off) / 2;
    }
  }
  return state;
}

/// Fit at the start. If effects are undefined there, for instance after removal of one that compensated for another,
/// their amplitudes are reduced. @throws simulation::EffectError if they remain undefined
ModelFit begun_at(const Problem& problem, State state, const RandomEffectSd& random_sd) {
  for (int halving = 0; halving < settings.max_start_halvings; ++halving) {
    try {
      return fit_linear_at(problem, state, random_sd);
    } catch (const simulation::EffectError&) {
      state = faded(std::move(state));
    }
  }
  return fit_linear_at(problem, std::move(state), random_sd);
}

/// First step along a direction, halved repeatedly, that lowers the deviance; nullopt if none does.
std::optional<ModelFit> line_search(const Problem& problem, const ModelFit& from, const Eigen::VectorXd& step,
                                    bool effects, const RandomEffectSd& random_sd) {
  for (double share = 1; share > 0.05; share /= 2) {
    try {
      ModelFit next = fit_linear_at(problem, stepped(problem, from.state, step, share, effects), random_sd);
      if (next.deviance < from.deviance) return next;
    } catch (const simulation::EffectError&) {
      continue;  // the effect is undefined there
    }
  }
  return std::nullopt;
}

/// Gauss-Newton steps within bounds. @param known derivatives of the first terms, which are reused
ModelFit descend(const Problem& problem, State start, bool effects, std::span<const Column> known = {},
                 double enough = settings.converged) {
  require_enough(problem.data.size(), problem.left_out);
  const bool bends = !problem.light_seen();  // the change by reflectivities depends on the state
  const Precomputed given = start.precomputed;
  start.log_reflectivity.resize(problem.targets.size(), 0);
  const RandomEffectSd random_sd = start.random_sd;
  ModelFit best =
      effects ? begun_at(problem, std::move(start), random_sd) : fit_linear_at(problem, std::move(start), random_sd);
  for (int iteration = 0; iteration < settings.max_fit_steps; ++iteration) {
    if (bends) update_reflectivity_jacobian(problem, best.state);
    const auto rows = expected(problem, best.state);
    std::vector<Column> columns(known.begin(), known.end());
    if (effects) columns = jacobian(problem, best.state, rows, std::move(columns));
    const Profile now =
        profile(grams_of(problem, best.state, rows, columns), problem.unknowns(columns.size()), best.state.random_sd);
    best.covariance = now.solution.covariance;
    best.dimension = now.solution.dimension + of_maps(best.state);
    if (best.deviance - now.solution.deviance < enough) break;
    const Eigen::VectorXd step = effects ? within_bounds(problem, best.state, columns, rows, now) : now.solution.values;
    std::optional<ModelFit> next = line_search(problem, best, step, effects, now.random_sd);
    if (!next) break;
    const double gain = best.deviance - next->deviance;
    next->covariance = best.covariance;
    next->dimension = best.dimension;
    best = std::move(*next);
    if (gain < enough) break;
  }
  best.state.precomputed = given;
  return best;
}

}  // namespace

double ModelFit::bic(std::size_t conditions) const {
  double prior = 0;
  for (const Term& term : state.terms) {
    const Candidate& candidate = *term.candidate;
    for (std::size_t r = 0; r < candidate.refinements().size(); ++r) {
      if (!candidate.refined(r)) continue;
      const std::size_t size = candidate.first_parameter_of(r);
      const FreeParameter& p = candidate.free()[size];
      prior += std::pow((term.values[size] - p.off) / p.typical, 2);
    }
  }
  return deviance + dimension * std::log(static_cast<double>(conditions)) + prior;
}

State with_positive_amplitudes(const Problem& problem, State state) {
  constexpr double same = 1e-9;  // m, or relative
  const auto rows = expected(problem, state);
  for (std::size_t t = 0; t < state.terms.size(); ++t) {
    const auto& free = state.terms[t].candidate->free();
    for (std::size_t size = 0; size < free.size(); ++size) {
      if (free[size].nonlinear || free[size].minimum >= 0 || state.terms[t].values[size] >= 0) continue;
      for (std::size_t angle = 0; angle < free.size(); ++angle) {
        if (!free[angle].is_angle()) continue;
        State turned = state;
        std::vector<double>& values = turned.terms[t].values;
        values[size] = -values[size];
        values[angle] = turned_by(free[angle], values[angle], std::numbers::pi);
        const auto other = expected(problem, turned);
        double most = 0;
        for (std::size_t i = 0; i < rows.size(); ++i) {
          for (std::size_t r = 0; r < rows[i].size(); ++r) most = std::max(most, std::abs(rows[i][r] - other[i][r]));
        }
        if (most < same) state = std::move(turned);
      }
    }
  }
  return state;
}

ModelFit with_jacobian(const Problem& problem, ModelFit fit) {
  fit.jacobian = jacobian(problem, fit.state, expected(problem, fit.state));
  return fit;
}

double deviance_of(const Problem& problem, const State& state) {
  return solve_linear(problem, state, expected(problem, state), {}, problem.unknowns(0)).deviance;
}

bool drift_shows(const Problem& problem, const State& state, double RandomEffectSd::*drift,
                 double RandomEffectSd::*scatter) {
  const auto& used = problem.nuisances.sd;
  if (!contains(used, drift)) return false;
  State still = state;
  RandomEffectSd& sd = still.random_sd;
  sd.*scatter = std::hypot(sd.*scatter, drift_of(problem.design, std::exchange(sd.*drift, settings.min_sd)));
  return deviance_of(problem, still) > deviance_of(problem, state) + settings.min_drift_gain;
}

State with_drift_mean(const Problem& problem, State state) {
  const bool shows = !is_at_bound(state.random_sd, &RandomEffectSd::drift) &&
                     drift_shows(problem, state, &RandomEffectSd::drift, &RandomEffectSd::jitter);
  state.random_sd.mean = shows ? state.random_sd.drift : settings.min_sd;
  return state;
}

ModelFit fit(const Problem& problem, State start) { return descend(problem, std::move(start), true); }

ModelFit fit_roughly(const Problem& problem, State start, std::span<const Column> known) {
  return descend(problem, std::move(start), true, known, settings.roughly_converged);
}

ModelFit fit_nuisances(const Problem& problem, State start) { return descend(problem, std::move(start), false); }

ModelFit fit_as_written(const Problem& problem, State start) {
  if (!start.terms.empty()) update_precomputed(problem, start);
  return fit_nuisances(problem, std::move(start));
}

}  // namespace tofgraph::diagnosis
