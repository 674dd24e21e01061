// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace tofgraph::diagnosis {
namespace {

constexpr int most_iterations = 30;
constexpr double settled = 0.02, roughly_settled = 0.5;  ///< of the deviance

double of_maps(const State& state) {
  double dimension = 0;
  for (const Term& term : state.terms) dimension += term.maps ? term.maps->dimension() : 0;
  return dimension;
}

double turned_by(const FreeParameter& p, double value, double angle) {
  const double next = value + angle;
  return next - 2 * std::numbers::pi * std::floor((next - p.minimum) / (2 * std::numbers::pi));
}

/// A step of a parameter in its unit, kept within bounds and, for shapes, short.
double moved(const FreeParameter& p, double value, double step) {
  if (p.is_angle()) {
    return turned_by(p, value, std::clamp(step, -0.7, 0.7));
  }
  if (p.shape) {
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
  for (std::size_t t = 0; t < problem.targets.size(); ++t) to.light[t] += share * step(j++);
  return to;
}

/// The step of least squares in which no parameter that is at a bound goes beyond it.
Eigen::VectorXd within_bounds(const Problem& problem, const State& state, const std::vector<Column>& columns,
                              const std::vector<std::vector<double>>& rows, std::span<const double> weight,
                              const Profile& free) {
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
      profile(grams_of(problem, rows, inside), problem.unknowns(inside.size()), weight, free.variances).solution.values;
  step.head(j).setZero();
  for (std::size_t c = 0; c < kept.size(); ++c) step(kept[c]) = less(static_cast<Eigen::Index>(c));
  const Eigen::Index rest = less.size() - static_cast<Eigen::Index>(kept.size());
  step.tail(rest) = less.tail(rest);
  return step;
}

/// Appends the derivatives of all terms' parameters but for those that are there already.
void append_columns(const Problem& problem, const State& state, const std::vector<std::vector<double>>& rows,
                    std::vector<Column>& columns) {
  std::size_t j = 0;
  for (std::size_t t = 0; t < state.terms.size(); ++t) {
    for (std::size_t k = 0; k < state.terms[t].candidate->free().size(); ++k, ++j) {
      if (j >= columns.size()) columns.push_back(derivative(problem, state, rows, t, k));
    }
  }
}

/// A state with the reflectivities and variances that suit its effects: linear, and all in profile().
Fit settled_at(const Problem& problem, State state, std::span<const double> weight, const Variances& variances) {
  // Where only effects show them reflectivities are not linear: they go with the effects' steps.
  const bool linear = problem.light_seen();
  const std::vector<int> none(problem.target.size(), -1);
  Unknowns unknowns = problem.unknowns(0);
  if (!linear) unknowns.target = none, unknowns.targets = 0;
  const Profile after = profile(grams_of(problem, expected(problem, state), {}), unknowns, weight, variances);
  for (std::size_t t = 0; linear && t < state.light.size(); ++t)
    state.light[t] += after.solution.values(static_cast<Eigen::Index>(t));
  state.variances = after.variances;
  return {std::move(state), after.solution.deviance, 0, {}};
}

/// A state with its sizes halfway to where they change nothing.
State faded(State state) {
  for (Term& term : state.terms) {
    for (std::size_t k = 0; k < term.values.size(); ++k) {
      const FreeParameter& p = term.candidate->free()[k];
      if (!p.shape) term.values[k] = p.off + (term.values[k] - p.off) / 2;
    }
  }
  return state;
}

/// Where effects give no number at the start, as when one that made up for another has been taken away, the start is
/// moved to where they do less. @throws simulation::EffectError when that does not help
Fit begun_at(const Problem& problem, State state, std::span<const double> weight, const Variances& variances) {
  constexpr int most_halvings = 6;
  for (int halving = 0; halving < most_halvings; ++halving) {
    try {
      return settled_at(problem, state, weight, variances);
    } catch (const simulation::EffectError&) {
      state = faded(std::move(state));
    }
  }
  return settled_at(problem, std::move(state), weight, variances);
}

/// The first step along a direction that lowers the deviance, halved while it does not; nothing where none does.
std::optional<Fit> line_search(const Problem& problem, const Fit& from, const Eigen::VectorXd& step, bool effects,
                               std::span<const double> weight, const Variances& variances) {
  for (double share = 1; share > 0.05; share /= 2) {
    try {
      Fit next = settled_at(problem, stepped(problem, from.state, step, share, effects), weight, variances);
      if (next.deviance < from.deviance) return next;
    } catch (const simulation::EffectError&) {
      continue;  // the step goes to where the effect gives no number
    }
  }
  return std::nullopt;
}

/// Gauss and Newton's steps within bounds. @param known derivatives of the first terms that are not taken again
Fit descend(const Problem& given, State start, std::span<const double> weight, bool effects,
            std::span<const Column> known = {}, double enough = settled) {
  const auto left = static_cast<std::size_t>(std::ranges::count_if(weight, [](double w) { return w != 0; }));
  require_enough(left, {fmt::format("{} that are put aside", weight.size() - left)});
  std::optional<Problem> lit;  // where what reflectivities change is not the same everywhere
  if (!given.light_seen()) lit.emplace(given);
  const Problem& problem = lit ? *lit : given;
  start.light.resize(problem.targets.size(), 0);
  const Variances variances = start.variances;
  Fit best = effects ? begun_at(problem, std::move(start), weight, variances)
                     : settled_at(problem, std::move(start), weight, variances);
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    if (lit) brighten(*lit, best.state);
    const auto rows = expected(problem, best.state);
    std::vector<Column> columns(known.begin(), known.end());
    if (effects) append_columns(problem, best.state, rows, columns);
    const Profile now =
        profile(grams_of(problem, rows, columns), problem.unknowns(columns.size()), weight, best.state.variances);
    best.covariance = now.solution.covariance;
    best.dimension = now.solution.dimension + of_maps(best.state);
    if (best.deviance - now.solution.deviance < enough) break;
    const Eigen::VectorXd step =
        effects ? within_bounds(problem, best.state, columns, rows, weight, now) : now.solution.values;
    std::optional<Fit> next = line_search(problem, best, step, effects, weight, now.variances);
    if (!next) break;
    const double gain = best.deviance - next->deviance;
    next->covariance = best.covariance;
    next->dimension = best.dimension;
    best = std::move(*next);
    if (gain < enough) break;
  }
  return best;
}

}  // namespace

std::size_t first_parameter(const State& state, std::size_t term) {
  std::size_t first = 0;
  for (std::size_t earlier = 0; earlier < term; ++earlier) first += state.terms[earlier].values.size();
  return first;
}

State with_positive_sizes(const Problem& problem, State state) {
  constexpr double same = 1e-9;  // m, and of what is relative
  const auto rows = expected(problem, state);
  for (std::size_t t = 0; t < state.terms.size(); ++t) {
    const auto& free = state.terms[t].candidate->free();
    for (std::size_t size = 0; size < free.size(); ++size) {
      if (free[size].shape || free[size].minimum >= 0 || state.terms[t].values[size] >= 0) continue;
      for (std::size_t angle = 0; angle < free.size(); ++angle) {
        if (!free[angle].shape || !free[angle].is_angle()) continue;
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

std::vector<Column> own_columns(const Problem& problem, const State& state,
                                const std::vector<std::vector<double>>& rows) {
  std::vector<Column> columns;
  append_columns(problem, state, rows, columns);
  return columns;
}

Solution least_squares(const Problem& problem, const std::vector<std::vector<double>>& rows,
                       std::span<const Column> columns, const Unknowns& unknowns, const Variances& variances) {
  std::vector<Gram> grams = grams_of(problem, rows, columns);
  std::vector<double> determinants(grams.size());
  for (std::size_t i = 0; i < grams.size(); ++i) grams[i] = marginal(grams[i], variances, determinants[i]);
  const std::vector<double> all(grams.size(), 1);
  return solve(assemble(grams, determinants, unknowns, all), unknowns, variances);
}

std::vector<std::vector<double>> with_nuisances(const Problem& problem, std::vector<std::vector<double>> rows,
                                                const Variances& variances) {
  if (problem.nuisances.sd.empty()) return rows;
  const std::vector<int> known(rows.size(), -1);
  Unknowns unknowns = problem.unknowns(0);
  unknowns.target = known, unknowns.targets = 0;
  const Eigen::VectorXd values = least_squares(problem, rows, {}, unknowns, variances).values;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (const Shared& shared : problem.nuisances.of_condition[i]) {
      const double height = shared.factor * values(shared.unknown);
      for (std::size_t row = 0; row < rows[i].size(); ++row)
        rows[i][row] += height * problem.shared_response(shared.direction, i, row);
    }
  }
  return rows;
}

double deviance_of(const Problem& problem, const State& state) {
  return least_squares(problem, expected(problem, state), {}, problem.unknowns(0), state.variances).deviance;
}

Fit fit(const Problem& problem, State start, std::span<const double> weight) {
  return descend(problem, std::move(start), weight, true);
}

Fit fit_roughly(const Problem& problem, State start, std::span<const double> weight) {
  return descend(problem, std::move(start), weight, true, {}, roughly_settled);
}

Fit fit_last(const Problem& problem, State start, std::span<const double> weight, std::span<const Column> known) {
  return descend(problem, std::move(start), weight, true, known, roughly_settled);
}

Fit fit_nuisances(const Problem& problem, State start, std::span<const double> weight) {
  return descend(problem, std::move(start), weight, false);
}

}  // namespace tofgraph::diagnosis
