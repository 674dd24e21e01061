// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/search/maps.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/validation.hpp"

#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tofgraph::diagnosis {
namespace {

std::vector<MapParameter> parameters_of(const EstimatedMaps& maps) {
  std::vector<MapParameter> parameters;
  for (const EstimatedMaps::Map& map : maps.maps()) parameters.push_back(map.parameter);
  return parameters;
}

/// Changes by maps that are estimated together.
struct Response {
  std::vector<MapParameter> parameters;
  std::vector<double> steps;  ///< steps of the values, SI
  Group group;
};

/// @param dimension number of values that the data determine
std::shared_ptr<const EstimatedMaps> estimated(const Problem& problem, std::vector<EstimatedMaps::Map> maps,
                                               double dimension) {
  return std::make_shared<const EstimatedMaps>(std::move(maps), dimension, problem.design.side(),
                                               problem.design.camera());
}

/// @param dimension number of values that the data determine; values beyond the bound of a pixel are clamped
Term term_of(const Problem& problem, const Candidate& candidate, std::vector<EstimatedMaps::Map> maps,
             double dimension) {
  for (EstimatedMaps::Map& map : maps) {
    const double bound = map.parameter.bound(problem.design);
    for (double& value : map.values) value = std::clamp(value, -bound, bound);
  }
  Term term{&candidate, {candidate.free().front().typical}};
  term.maps = estimated(problem, std::move(maps), dimension);
  return term;
}

/// Median over the visible superpixels of a column's norm over all conditions, in standard deviations.
double norm_of(const Problem& problem, const Column& column) {
  const std::size_t n = problem.design.superpixels();
  std::vector<double> squares(n, 0);
  for (std::size_t i = 0; i < column.size(); ++i) {
    for (std::size_t row = 0; row < column[i].size(); ++row) {
      const double variance = problem.data[i].variance[row];
      if (std::isfinite(variance)) squares[row % n] += column[i][row] * column[i][row] / variance;
    }
  }
  std::erase(squares, 0.0);
  return squares.empty() ? 0 : std::sqrt(physics::median(squares));
}

/// Changes by maps for one step. Maps whose largest possible values change nothing are left out.
/// @throws simulation::EffectError
Response response(const Problem& problem, const State& state, const Candidate& candidate,
                  std::span<const MapParameter> parameters) {
  const auto rows = expected(problem, state);
  Response result{{}, {}, {.by_superpixel = true}};
  for (const MapParameter& parameter : parameters) {
    State with = state;
    with.terms.push_back(
        term_of(problem, candidate, {{parameter, std::vector<double>(problem.design.superpixels(), map_probe)}}, 0));
    Column column = difference(expected(problem, with), rows);
    const double norm = norm_of(problem, column);
    if (!(norm * parameter.bound(problem.design) / map_probe > settings.map_min_visible))
      continue;  // zero except for rounding
    const double factor = settings.map_step_sd / norm;
    for (std::vector<double>& condition : column) {
      for (double& value : condition) value *= factor;
    }
    result.parameters.push_back(parameter);
    result.steps.push_back(factor * map_probe);
    result.group.columns.push_back(std::move(column));
  }
  return result;
}

/// Response of the maps of a state.
Response response_of(const Problem& problem, State state, std::size_t term) {
  const Term one = state.terms[term];
  return response(problem, removed(std::move(state), {term, {}}), *one.candidate, parameters_of(*one.maps));
}

std::vector<EstimatedMaps::Map> values_of(const Problem& problem, const Response& response, const Score& score) {
  const std::size_t n = problem.design.superpixels();
  std::vector<EstimatedMaps::Map> maps;
  for (std::size_t m = 0; m < response.parameters.size(); ++m) {
    maps.push_back({response.parameters[m], {}});
    for (std::size_t s = 0; s < n; ++s)
      maps.back().values.push_back(response.steps[m] * score.values(static_cast<Eigen::Index>(m * n + s)));
  }
  return maps;
}

Response subset(const Response& all, const std::vector<std::size_t>& chosen) {
  Response result{{}, {}, {.by_superpixel = true}};
  for (const std::size_t m : chosen) {
    result.parameters.push_back(all.parameters[m]);
    result.steps.push_back(all.steps[m]);
    result.group.columns.push_back(all.group.columns[m]);
  }
  return result;
}

/// Gain of a map if nothing else were fitted: a sum over the superpixels, each with its own value. A cheap first test,
/// because most campaigns have no maps.
double max_gain(const Problem& problem, const std::vector<Eigen::MatrixXd>& left, const Column& column) {
  const std::size_t n = problem.design.superpixels();
  std::vector<double> product(n, 0), square(n, 0);
  for (std::size_t i = 0; i < column.size(); ++i) {
    for (std::size_t row = 0; row < column[i].size(); ++row) {
      const double variance = problem.data[i].variance[row];
      if (std::isinf(variance)) continue;
      const double one = column[i][row] / std::sqrt(variance);
      product[row % n] += one * left[row / n](static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(row % n));
      square[row % n] += one * one;
    }
  }
  double gain = 0;
  for (std::size_t s = 0; s < n; ++s) gain += square[s] > 0 ? product[s] * product[s] / square[s] : 0;
  return gain;
}

/// Maps of a candidate that are worth their parameters, selected one by one.
Response chosen_maps(const Problem& problem, const ModelFit& base, const Response& all) {
  const double price = std::log(static_cast<double>(problem.data.size()));
  const std::vector<Eigen::MatrixXd> left = whitened_residuals(problem, base.state);
  const double needed = settings.map_min_rough_gain * price * static_cast<double>(problem.design.superpixels());
  const auto hopeless = [&](const Column& column) { return max_gain(problem, left, column) < needed; };
  if (std::ranges::all_of(all.group.columns, hopeless)) return subset(all, {});
  std::vector<std::size_t> chosen;
  double merit = 0;
  for (;;) {
    std::optional<std::size_t> best;
    for (std::size_t m = 0; m < all.parameters.size(); ++m) {
      if (contains(chosen, m)) continue;
      std::vector<std::size_t> more = chosen;
      more.push_back(m);
      const Score now = score_of(problem, base, subset(all, more).group);
      if (now.gain - price * now.dimension <= merit) continue;
      merit = now.gain - price * now.dimension;
      best = m;
    }
    if (!best) return subset(all, chosen);
    chosen.push_back(*best);
  }
}

/// Limits the scatter of the boards to the usual one. While the mean of the maps is wrong by a value that varies with
/// the distance, the scatter grows until it hides the error.
RandomEffectSd limited_to_usual(RandomEffectSd found) {
  constexpr RandomEffectSd usual;
  found.jitter = std::min(found.jitter, usual.jitter);
  return found;
}

/// State with the maps of a term updated by the scores of its residual.
State with_updated_maps_of_term(const Problem& problem, State state, std::size_t term) {
  const Term before = state.terms[term];
  ModelFit fit;
  fit.state = state;
  fit.state.random_sd = limited_to_usual(state.random_sd);
  const auto rows = expected(problem, state);
  fit.jacobian = jacobian(problem, state, rows);
  const std::size_t scale = first_parameter(state, term);
  fit.jacobian.erase(fit.jacobian.begin() + static_cast<std::ptrdiff_t>(scale));  // represented by the maps
  const Response answer = response_of(problem, state, term);
  const Score now = score_of(problem, fit, answer.group);
  const double factor = before.values.front() / before.candidate->free().front().typical;
  std::vector<EstimatedMaps::Map> maps = before.maps->maps();
  for (EstimatedMaps::Map& map : maps) {
    for (double& value : map.values) value *= factor;
  }
  for (const EstimatedMaps::Map& change : values_of(problem, answer, now)) {
    const auto changed =
        std::ranges::find_if(maps, [&](const auto& map) { return map.parameter.index == change.parameter.index; });
    for (std::size_t s = 0; s < change.values.size(); ++s) changed->values[s] += change.values[s];
  }
  state.terms[term] = term_of(problem, *before.candidate, std::move(maps), before.maps->dimension());
  return state;
}

/// Fit of a step, or nothing if the step leads to values at which an effect is undefined.
template <class Step> std::optional<ModelFit> attempted(const Step& step, const State& from) {
  try {
    return step(from);
  } catch (const simulation::EffectError&) {
    return std::nullopt;
  }
}

/// Improves a fit while the deviance falls by more than `enough`; a step may go too far if effects are nearly
/// equivalent to maps. @param step from a state to the next fit
template <class Step> ModelFit improved(ModelFit best, int most, double enough, const Step& step) {
  for (int round = 0; round < most; ++round) {
    std::optional<ModelFit> next = attempted(step, best.state);
    if (!next) break;
    const double gain = best.deviance - next->deviance;
    if (gain > 0) best = *std::move(next);
    if (!(gain > enough)) break;
  }
  return best;
}

MapTrial fitted(const Problem& problem, const ModelFit& base, const Candidate& candidate, const Response& maps,
                std::uint64_t seed) {
  MapTrial result{{&candidate, {}, score_of(problem, base, maps.group, seed)}};
  State state = base.state;
  state.terms.push_back(term_of(problem, candidate, values_of(problem, maps, result.score), result.score.dimension));
  result.fit = fit_roughly(problem, std::move(state), base.jacobian);
  result.fit = improved(std::move(result.fit), settings.map_trial_rounds, 0, [&](const State& now) {
    return fit_roughly(problem, with_updated_maps_of_term(problem, now, now.terms.size() - 1), base.jacobian);
  });
  result.lack_of_fit = lack_of_fit(problem, with_jacobian(problem, result.fit));
  return result;
}

/// A parameter that adds the same to all distances, and the response per unit.
struct Constant {
  std::size_t term = 0, parameter = 0;
  double response = 0;
};

/// Value of a column that is equal in all known distances and changes nothing else; 0 for other columns.
double height_of(const Problem& problem, const Column& column) {
  constexpr double same = 1e-6;
  double first = 0;
  for (std::size_t i = 0; i < column.size(); ++i) {
    if (!problem.design.shows_board(i)) continue;
    for (std::size_t row = 0; row < column[i].size(); ++row) {
      if (std::isinf(problem.data[i].variance[row])) continue;
      const bool length = problem.is_of(distance, row);
      if (length && first == 0) first = column[i][row];
      const double expected = length ? first : 0;
      if (!(std::abs(column[i][row] - expected) <= same * std::max(std::abs(first), 1e-6))) return 0;
    }
  }
  return first;
}

std::optional<Constant> constant_of(const Problem& problem, const State& state) {
  const auto rows = expected(problem, state);
  for (std::size_t t = 0; t < state.terms.size(); ++t) {
    const Term& term = state.terms[t];
    for (std::size_t k = 0; !term.maps && k < term.values.size(); ++k) {
      const FreeParameter& p = term.candidate->free()[k];
      if (p.nonlinear) continue;
      const double height = height_of(problem, derivative(problem, state, rows, t, k));
      if (height != 0) return Constant{t, k, height / p.typical};
    }
  }
  return std::nullopt;
}

}  // namespace

bool has_maps(const State& state) {
  return std::ranges::any_of(state.terms, [](const Term& t) { return t.maps != nullptr; });
}

bool maps_follow(const State& state) {
  return std::ranges::count_if(state.terms, [](const Term& t) { return t.maps != nullptr; }) == 1;
}

std::optional<MapTrial> best_maps(const Problem& problem, const ModelFit& base, const Candidates& candidates,
                                  std::map<std::string, std::string>& refused, std::uint64_t seed) {
  std::optional<MapTrial> best;
  if (problem.design.superpixels() < 2) return best;
  for (const auto& candidate : candidates) {
    if (candidate->maps().empty() || is_in(base.state, *candidate) || refused.contains(candidate->name())) continue;
    try {
      const Response all = response(problem, base.state, *candidate, candidate->maps());
      const Response chosen = chosen_maps(problem, base, all);
      if (chosen.parameters.empty()) continue;
      MapTrial trial = fitted(problem, base, *candidate, chosen, seed);
      const std::size_t n = problem.data.size();
      if (!best || trial.fit.bic(n) < best->fit.bic(n)) best = std::move(trial);
    } catch (const simulation::EffectError& error) {
      refused[candidate->name()] = error.what();
    }
  }
  return best;
}

ModelFit fit_with_map_of(const Problem& problem, State state, const Candidate& candidate) {
  const std::vector<double> nothing(problem.design.superpixels(), 0);
  state.terms.push_back(term_of(problem, candidate, {{candidate.maps().front(), nothing}}, 0));
  return fit_with_maps(problem, with_updated_maps(problem, std::move(state)));
}

Score score_of_maps(const Problem& problem, const ModelFit& without, const Term& term, std::uint64_t seed) {
  const Response answer = response(problem, without.state, *term.candidate, parameters_of(*term.maps));
  return score_of(problem, without, answer.group, seed);
}

State with_updated_maps(const Problem& problem, State state) {
  for (std::size_t t = 0; t < state.terms.size(); ++t) {
    if (state.terms[t].maps) state = with_updated_maps_of_term(problem, std::move(state), t);
  }
  return state;
}

std::vector<Column> map_columns(const Problem& problem, const State& state) {
  std::vector<Column> columns;
  for (std::size_t t = 0; t < state.terms.size(); ++t) {
    if (state.terms[t].maps)
      std::ranges::move(response_of(problem, state, t).group.columns, std::back_inserter(columns));
  }
  return columns;
}

ModelFit fit_roughly_with_maps(const Problem& problem, State start) {
  if (!maps_follow(start)) return fit_roughly(problem, std::move(start));
  const auto following = [&](State state) {
    return fit_roughly(problem, with_updated_maps(problem, std::move(state)));
  };
  std::optional<ModelFit> best = attempted(following, start);
  if (!best || best->deviance > deviance_of(problem, start))
    best = fit_roughly(problem, std::move(start));  // unchanged maps
  return improved(*std::move(best), settings.map_trial_rounds, settings.map_converged, following);
}

ModelFit fit_with_maps(const Problem& problem, State start) {
  ModelFit best = fit(problem, std::move(start));
  if (!has_maps(best.state)) return best;
  return improved(std::move(best), settings.map_max_rounds, settings.map_converged,
                  [&](const State& now) { return fit(problem, with_updated_maps(problem, now)); });
}

State with_means_in_constant(const Problem& problem, State state) {
  if (!has_maps(state)) return state;
  const std::optional<Constant> constant = constant_of(problem, state);
  if (!constant) return state;
  for (Term& term : state.terms) {
    if (!term.maps) continue;
    std::vector<EstimatedMaps::Map> maps = term.maps->maps();
    for (EstimatedMaps::Map& map : maps) {
      if (map.parameter.unit != "m") continue;
      const double mean = std::reduce(map.values.begin(), map.values.end()) / static_cast<double>(map.values.size());
      for (double& value : map.values) value -= mean;
      state.terms[constant->term].values[constant->parameter] += term.values.front() * mean / constant->response;
    }
    term.maps = estimated(problem, std::move(maps), term.maps->dimension());
  }
  return state;
}

}  // namespace tofgraph::diagnosis
