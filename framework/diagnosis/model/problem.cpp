// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/problem.hpp"

#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/model/nuisances.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

namespace tofgraph::diagnosis {
namespace {

/// Name of the effect that fails in a condition: the first that is undefined alone, else the last.
std::string failing_effect(const Problem& problem, const State& state, std::size_t condition, double light) {
  const Design& design = problem.design;
  for (const Term& term : state.terms) {
    const std::vector<double> alone =
        design.predict(forward_model(std::span(&term, 1), design.camera(), design.physical()), condition, light);
    for (std::size_t row = 0; row < alone.size(); ++row) {
      if (!std::isfinite(alone[row]) && !std::isinf(problem.data[condition].variance[row]))
        return term.candidate->name();
    }
  }
  return state.terms.empty() ? "none" : state.terms.back().candidate->name();
}

/// Change of the observables over a step; 0 outside the lens model of the state.
std::vector<double> slope(std::vector<double> there, const std::vector<double>& here, double step) {
  for (std::size_t row = 0; row < here.size(); ++row) {
    const double change = (there[row] - here[row]) / step;
    there[row] = std::isfinite(change) ? change : 0;
  }
  return there;
}

/// Updates the changes by reflectivities. @param bias true: also updates the bias of the coarse grid @param exactly see
/// update_precomputed()
void precompute(const Problem& problem, State& state, bool bias, bool exactly) {
  constexpr double step = 0.01;
  const Design& design = problem.design;
  const simulation::ForwardModel model = forward_model(state.terms, design.camera(), design.physical());
  const bool every_pixel = exactly || std::ranges::any_of(state.terms, [](const Term& term) {
                             return !term.maps && term.candidate->reads_files();
                           });
  const bool ideal = state.terms.empty();  // the change by light is then that of the ideal camera
  Rows grid_bias(design.size()), by_light(design.size());
  tbb::parallel_for(std::size_t{0}, design.size(), [&](std::size_t i) {
    const double light = log_reflectivity_of(problem, state, i);
    const std::vector<double> coarse = design.predict(model, i, light);
    if (bias) grid_bias[i] = slope(design.predict_finely(model, i, light, every_pixel), coarse, 1);
    if (!ideal) by_light[i] = slope(design.predict(model, i, light + step), coarse, step);
  });
  if (bias) state.precomputed.grid_bias = std::make_shared<const Rows>(std::move(grid_bias));
  state.precomputed.reflectivity_jacobian = ideal ? nullptr : std::make_shared<const Rows>(std::move(by_light));
}

}  // namespace

std::size_t term_of(const State& state, const Candidate& candidate) {
  const auto is_it = [&](const Term& term) { return term.candidate->name() == candidate.name(); };
  return static_cast<std::size_t>(std::ranges::find_if(state.terms, is_it) - state.terms.begin());
}

double log_reflectivity_of(const Problem& problem, std::span<const double> light, std::size_t condition) {
  const int target = problem.target[condition];
  return target < 0 || light.empty() ? 0 : light[static_cast<std::size_t>(target)];
}

std::size_t first_parameter(const State& state, std::size_t term, std::optional<std::size_t> refinement) {
  std::size_t first = refinement ? state.terms[term].candidate->first_parameter_of(*refinement) : 0;
  for (std::size_t earlier = 0; earlier < term; ++earlier) first += state.terms[earlier].values.size();
  return first;
}

State removed(State state, const ModelTerm& addition) {
  const auto term = state.terms.begin() + static_cast<std::ptrdiff_t>(addition.term);
  if (addition.refinement)
    *term = coarser(std::move(*term), *addition.refinement);
  else
    state.terms.erase(term);
  return state;
}

State first_state(const Problem& problem, const std::vector<Term>& terms) {
  State state{terms, first_log_reflectivity(problem), {}};
  if (!problem.design.tells_offset()) state.random_sd.offset = 0;
  return state;
}

State comparable_with(const State& other, State state) {
  state.nuisances = other.nuisances;
  state.precomputed = other.precomputed;
  return state;
}

State with_flat_boards(State state) {
  state.nuisances.boards = nullptr;
  return state;
}

Problem make_problem(const Design& design, const std::vector<Observations>& data, const Deadline* deadline) {
  for (std::size_t i = 0; i < data.size(); ++i) {
    for (std::size_t row = 0; row < data[i].value.size(); ++row) {
      if (std::isfinite(data[i].variance[row]) && !std::isfinite(data[i].value[row]))
        throw std::invalid_argument(
            fmt::format("condition '{}': its measurement is not a number", design.conditions()[i].id));
    }
  }
  Problem problem{design, data, {}, {}, nuisances_of(design, shows_another_contrast(design, data)), deadline};
  for (const io::Condition& condition : design.conditions()) {
    if (is_light_known(condition)) {
      problem.target.push_back(-1);
      continue;
    }
    auto found = std::ranges::find(problem.targets, condition.target);
    if (found == problem.targets.end()) found = problem.targets.insert(found, condition.target);
    problem.target.push_back(static_cast<int>(found - problem.targets.begin()));
  }
  if (!problem.targets.empty() && !problem.light_seen()) {  // of all targets together the light is not determined
    problem.targets.erase(problem.targets.begin());
    for (int& target : problem.target) target = std::max(target - 1, -1);
  }
  return problem;
}

Problem with_data(const Problem& problem, const std::vector<Observations>& data) {
  return {problem.design, data, problem.targets, problem.target, problem.nuisances, problem.deadline, problem.left_out};
}

Problem with_deadline(Problem problem, const Deadline& deadline) {
  problem.deadline = &deadline;
  return problem;
}

double mean_log_amplitude(const Problem& problem, std::size_t target, const Rows& expectation) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < problem.data.size(); ++i) {
    if (problem.target[i] != static_cast<int>(target)) continue;
    for (const std::size_t row : problem.known_rows(i, amplitude)) {
      sum += problem.data[i].value[row] - (expectation.empty() ? 0 : expectation[i][row]);
      ++count;
    }
  }
  return count > 0 ? sum / count : 0;
}

std::vector<double> first_log_reflectivity(const Problem& problem) {
  std::vector<double> light;
  for (std::size_t t = 0; t < problem.targets.size(); ++t) light.push_back(mean_log_amplitude(problem, t, {}));
  return light;
}

std::vector<double> log_reflectivity_from(const Problem& other, const State& state, const Problem& problem,
                                          std::vector<double> light) {
  for (std::size_t t = 0; t < problem.targets.size(); ++t) {
    const auto known = std::ranges::find(other.targets, problem.targets[t]);
    const auto at = static_cast<std::size_t>(known - other.targets.begin());
    if (at < state.log_reflectivity.size()) light[t] = state.log_reflectivity[at];
  }
  return light;
}

std::vector<Eigen::Index> runs_of(const Problem& problem, const State& state) {
  if (!state.nuisances.runs.empty()) return state.nuisances.runs;
  std::vector<Eigen::Index> single(problem.data.size());
  std::iota(single.begin(), single.end(), 0);
  return single;
}

double run_length(const Problem& problem, const State& state) {
  return static_cast<double>(problem.data.size()) / static_cast<double>(1 + std::ranges::max(runs_of(problem, state)));
}

bool are_seen(std::size_t observable, const Design& design, const std::vector<Observations>& data) {
  const std::size_t n = design.superpixels();
  return std::ranges::any_of(data, [=](const Observations& one) {
    const auto first = one.variance.begin() + static_cast<std::ptrdiff_t>(observable * n);
    return std::any_of(first, first + static_cast<std::ptrdiff_t>(n), [](double v) { return std::isfinite(v); });
  });
}

bool Problem::light_seen() const { return are_seen(amplitude, design, data); }

Rows expected(const Problem& problem, const State& state) {
  if (problem.deadline != nullptr) problem.deadline->check();
  const Design& design = problem.design;
  const simulation::ForwardModel model = forward_model(state.terms, design.camera(), design.physical());
  Rows rows(design.size());
  std::vector<std::uint8_t> failed(design.size(), 0);
  tbb::parallel_for(std::size_t{0}, design.size(), [&](std::size_t i) {
    rows[i] = design.predict(model, i, log_reflectivity_of(problem, state, i));
    if (const Rows* bias = state.precomputed.grid_bias.get(); bias != nullptr)
      for (std::size_t row = 0; row < rows[i].size(); ++row) rows[i][row] += (*bias)[i][row];
    if (const Boards* boards = state.nuisances.boards.get(); boards != nullptr)
      for (std::size_t row = 0; row < rows[i].size(); ++row) rows[i][row] += boards->rows[i][row];
    const std::vector<double>& variance = problem.data[i].variance;
    for (std::size_t row = 0; row < rows[i].size(); ++row) {
      if (std::isinf(variance[row]))
        rows[i][row] = 0;
      else if (!std::isfinite(rows[i][row]))
        failed[i] = 1;
    }
  });
  if (const auto first = std::ranges::find(failed, 1); first != failed.end()) {
    const auto i = static_cast<std::size_t>(first - failed.begin());
    throw simulation::EffectError(failing_effect(problem, state, i, log_reflectivity_of(problem, state, i)), "",
                                  fmt::format("gives no number for condition '{}'", design.conditions()[i].id));
  }
  return rows;
}

void update_precomputed(const Problem& problem, State& state, bool exactly) {
  precompute(problem, state, true, exactly);
}

void update_reflectivity_jacobian(const Problem& problem, State& state) {
  state.precomputed.reflectivity_jacobian = nullptr;
  if (!state.terms.empty()) precompute(problem, state, false, false);
}

Column difference(Column rows, const Column& other) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t row = 0; row < rows[i].size(); ++row) rows[i][row] -= other[i][row];
  }
  return rows;
}

Column derivative(const Problem& problem, const State& state, const Rows& rows, std::size_t term,
                  std::size_t parameter) {
  const FreeParameter& p = state.terms[term].candidate->free()[parameter];
  State other = state;
  double& value = other.terms[term].values[parameter];
  const double here = value, size = settings.derivative_step * p.typical;
  double step = here + size > p.maximum ? -size : size;
  Column column;
  for (int attempt = 0; column.empty(); ++attempt) {
    constexpr int max_attempts = 4;
    value = here + step;
    try {
      column = expected(problem, other);
    } catch (const simulation::EffectError&) {  // outside the effect's domain: reverses or shortens the step
      if (attempt == max_attempts) throw;
      step *= attempt % 2 == 0 ? -1 : 0.1;
    }
  }
  for (std::size_t i = 0; i < column.size(); ++i) {
    for (std::size_t row = 0; row < column[i].size(); ++row)
      column[i][row] = (column[i][row] - rows[i][row]) * (p.typical / step);
  }
  return column;
}

double normalised_rms(const Problem& problem, std::size_t condition, const std::vector<double>& change) {
  double largest = 0;
  for (std::size_t o = 0; o < observables; ++o) {
    double sum = 0, count = 0;
    for (const std::size_t row : problem.known_rows(condition, o)) {
      sum += change[row] * change[row];
      ++count;
    }
    if (count > 0) largest = std::max(largest, std::sqrt(sum / count) / settings.practical_threshold[o]);
  }
  return largest;
}

double max_normalised_rms(const Problem& problem, const Column& change) {
  double largest = 0;
  for (std::size_t i = 0; i < change.size(); ++i) largest = std::max(largest, normalised_rms(problem, i, change[i]));
  return largest;
}

std::vector<Column> jacobian(const Problem& problem, const State& state, const Rows& rows,
                             std::vector<Column> columns) {
  std::size_t j = 0;
  for (std::size_t t = 0; t < state.terms.size(); ++t) {
    for (std::size_t k = 0; k < state.terms[t].candidate->free().size(); ++k, ++j) {
      if (j >= columns.size()) columns.push_back(derivative(problem, state, rows, t, k));
    }
  }
  return columns;
}

Eigen::MatrixXd weighted_columns(const Problem& problem, const State& state, const std::vector<double>& rows,
                                 std::span<const Column> columns, std::size_t i) {
  const Observations& data = problem.data[i];
  const auto first = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(rows.size()), first + gram_tail);
  for (std::size_t row = 0; row < rows.size(); ++row) {
    if (std::isinf(data.variance[row])) continue;  // the columns may be undefined there
    const auto r = static_cast<Eigen::Index>(row);
    const double weight = 1 / std::sqrt(data.variance[row]);
    for (Eigen::Index c = 0; c < first; ++c) all(r, c) = weight * columns[static_cast<std::size_t>(c)][i][row];
    const std::array<double, gram_tail> tail = {
        state.jitter_response(problem, i, row), problem.offset_response(i, row),
        state.light_response(problem, i, row),  problem.uniform_response(i, row),
        problem.contrast_response(i, row),      data.value[row] - rows[row]};
    for (Eigen::Index t = 0; t < gram_tail; ++t) all(r, first + t) = weight * tail[static_cast<std::size_t>(t)];
  }
  if (state.nuisances.smooth_field)
    state.nuisances.smooth_field->whiten(i, all.topRows(static_cast<Eigen::Index>(problem.design.superpixels())));
  return all;
}

std::vector<Gram> grams_of(const Problem& problem, const State& state, const Rows& rows,
                           std::span<const Column> columns) {
  std::vector<Gram> grams(rows.size());
  tbb::parallel_for(std::size_t{0}, rows.size(), [&](std::size_t i) {
    const Eigen::MatrixXd all = weighted_columns(problem, state, rows[i], columns, i);
    Gram gram = Gram::Zero(all.cols(), all.cols());
    gram.selfadjointView<Eigen::Lower>().rankUpdate(all.transpose());
    grams[i] = gram.selfadjointView<Eigen::Lower>();
  });
  return grams;
}

Solution solve_linear(const Problem& problem, const State& state, const Rows& rows, std::span<const Column> columns,
                      const Unknowns& unknowns) {
  std::vector<Gram> grams = grams_of(problem, state, rows, columns);
  const std::vector<double> determinants = marginalise(grams, state.random_sd);
  return solve(assemble(grams, determinants, unknowns), unknowns, state.random_sd);
}

Rows with_nuisances(const Problem& problem, const State& state, Rows rows) {
  if (problem.nuisances.sd.empty()) return rows;
  const std::vector<int> known(rows.size(), -1);
  Unknowns unknowns = problem.unknowns(0);
  unknowns.target = known, unknowns.targets = 0;
  const Eigen::VectorXd values = solve_linear(problem, state, rows, {}, unknowns).values;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (const Shared& shared : problem.nuisances.of_condition[i]) {
      const double height = shared.factor * values(shared.unknown);
      for (std::size_t row = 0; row < rows[i].size(); ++row)
        rows[i][row] += height * state.shared_response(problem, shared.direction, i, row);
    }
  }
  return rows;
}

}  // namespace tofgraph::diagnosis
