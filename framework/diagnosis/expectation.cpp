// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// What a model expects of every condition, and how that changes with its parameters.
#include "diagnosis/another_contrast.hpp"
#include "diagnosis/fit.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace tofgraph::diagnosis {
namespace {

constexpr double derivative_step = 0.02;  ///< in typical steps: small enough for wide shapes, large against rounding

/// Of the effects that give no number for a condition together: the first that does so alone, else the last.
std::string guilty(const Problem& problem, const State& state, std::size_t condition, double light) {
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

}  // namespace

double light_of(const Problem& problem, const State& state, std::size_t condition) {
  const int target = problem.target[condition];
  return target < 0 || state.light.empty() ? 0 : state.light[static_cast<std::size_t>(target)];
}

Problem make_problem(const Design& design, const std::vector<Observations>& data) {
  for (std::size_t i = 0; i < data.size(); ++i) {
    for (std::size_t row = 0; row < data[i].value.size(); ++row) {
      if (std::isfinite(data[i].variance[row]) && !std::isfinite(data[i].value[row]))
        throw std::invalid_argument(
            fmt::format("condition '{}': its measurement is no number", design.conditions()[i].id));
    }
  }
  Problem problem{design, data, {}, {}, nuisances_of(design, shows_another_contrast(design, data))};
  for (const io::Condition& condition : design.conditions()) {
    if (is_light_known(condition)) {
      problem.target.push_back(-1);
      continue;
    }
    auto found = std::ranges::find(problem.targets, condition.target);
    if (found == problem.targets.end()) found = problem.targets.insert(found, condition.target);
    problem.target.push_back(static_cast<int>(found - problem.targets.begin()));
  }
  if (!problem.targets.empty() && !problem.light_seen()) {  // of all together the amount cannot be told
    problem.targets.erase(problem.targets.begin());
    for (int& target : problem.target) target = std::max(target - 1, -1);
  }
  return problem;
}

Problem with_data(const Problem& problem, const std::vector<Observations>& data) {
  return {problem.design,      data,
          problem.targets,     problem.target,
          problem.nuisances,   problem.correction,
          problem.brightening, problem.allowed,
          problem.deadline};
}

std::vector<double> first_light(const Problem& problem) {
  std::vector<double> sum(problem.targets.size(), 0), count(problem.targets.size(), 0);
  const std::size_t n = problem.design.superpixels();
  for (std::size_t i = 0; i < problem.data.size(); ++i) {
    if (problem.target[i] < 0) continue;
    const auto t = static_cast<std::size_t>(problem.target[i]);
    for (std::size_t row = amplitude * n; row < (amplitude + 1) * n; ++row) {
      if (std::isinf(problem.data[i].variance[row])) continue;
      sum[t] += problem.data[i].value[row];
      ++count[t];
    }
  }
  for (std::size_t t = 0; t < sum.size(); ++t) sum[t] = count[t] > 0 ? sum[t] / count[t] : 0;
  return sum;
}

std::vector<Eigen::Index> Problem::runs() const {
  if (!allowed.runs.empty()) return allowed.runs;
  std::vector<Eigen::Index> single(data.size());
  std::iota(single.begin(), single.end(), 0);
  return single;
}

double Problem::run_length() const {
  return static_cast<double>(data.size()) / static_cast<double>(1 + std::ranges::max(runs()));
}

bool are_seen(std::size_t observable, const Design& design, const std::vector<Observations>& data) {
  const std::size_t n = design.superpixels();
  return std::ranges::any_of(data, [=](const Observations& one) {
    const auto first = one.variance.begin() + static_cast<std::ptrdiff_t>(observable * n);
    return std::any_of(first, first + static_cast<std::ptrdiff_t>(n), [](double v) { return std::isfinite(v); });
  });
}

bool Problem::light_seen() const { return are_seen(amplitude, design, data); }

std::vector<std::vector<double>> expected(const Problem& problem, const State& state) {
  problem.deadline.check();
  const Design& design = problem.design;
  const simulation::ForwardModel model = forward_model(state.terms, design.camera(), design.physical());
  std::vector<std::vector<double>> rows(design.size());
  std::vector<std::uint8_t> failed(design.size(), 0);
  tbb::parallel_for(std::size_t{0}, design.size(), [&](std::size_t i) {
    rows[i] = design.predict(model, i, light_of(problem, state, i));
    if (!problem.correction.empty())
      for (std::size_t row = 0; row < rows[i].size(); ++row) rows[i][row] += problem.correction[i][row];
    if (problem.allowed.boards)
      for (std::size_t row = 0; row < rows[i].size(); ++row) rows[i][row] += problem.allowed.boards->rows[i][row];
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
    throw simulation::EffectError(guilty(problem, state, i, light_of(problem, state, i)), "",
                                  fmt::format("gives no number for condition '{}'", design.conditions()[i].id));
  }
  return rows;
}

void correct(Problem& problem, const State& state, bool exactly) {
  const Design& design = problem.design;
  const simulation::ForwardModel model = forward_model(state.terms, design.camera(), design.physical());
  const bool every_pixel = exactly || std::ranges::any_of(state.terms, [](const Term& term) {
                             return !term.maps && term.candidate->reads_files();
                           });
  std::vector<std::vector<double>> correction(design.size());
  tbb::parallel_for(std::size_t{0}, design.size(), [&](std::size_t i) {
    const double light = light_of(problem, state, i);
    correction[i] = design.predict_finely(model, i, light, every_pixel);
    const std::vector<double> coarse = design.predict(model, i, light);
    for (std::size_t row = 0; row < coarse.size(); ++row) {
      const double difference = correction[i][row] - coarse[row];
      correction[i][row] = std::isfinite(difference) ? difference : 0;  // outside the lens model of this state
    }
  });
  problem.correction = std::move(correction);
  brighten(problem, state);
}

void brighten(Problem& problem, const State& state) {
  constexpr double step = 0.01;
  problem.brightening.clear();
  if (state.terms.empty()) return;  // the ideal camera's
  const Design& design = problem.design;
  const simulation::ForwardModel model = forward_model(state.terms, design.camera(), design.physical());
  std::vector<std::vector<double>> brightening(design.size());
  tbb::parallel_for(std::size_t{0}, design.size(), [&](std::size_t i) {
    const double light = light_of(problem, state, i);
    brightening[i] = design.predict(model, i, light + step);
    const std::vector<double> coarse = design.predict(model, i, light);
    for (std::size_t row = 0; row < coarse.size(); ++row) {
      const double change = (brightening[i][row] - coarse[row]) / step;
      brightening[i][row] = std::isfinite(change) ? change : 0;
    }
  });
  problem.brightening = std::move(brightening);
}

Column difference(Column rows, const Column& other) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t row = 0; row < rows[i].size(); ++row) rows[i][row] -= other[i][row];
  }
  return rows;
}

Column derivative(const Problem& problem, const State& state, const std::vector<std::vector<double>>& rows,
                  std::size_t term, std::size_t parameter) {
  const FreeParameter& p = state.terms[term].candidate->free()[parameter];
  State other = state;
  double& value = other.terms[term].values[parameter];
  const double here = value, size = derivative_step * p.typical;
  double step = here + size > p.maximum ? -size : size;
  Column column;
  for (int attempt = 0; column.empty(); ++attempt) {
    constexpr int most_attempts = 4;
    value = here + step;
    try {
      column = expected(problem, other);
    } catch (const simulation::EffectError&) {  // at the edge of what the effect can do: to the other side, and less
      if (attempt == most_attempts) throw;
      step *= attempt % 2 == 0 ? -1 : 0.1;
    }
  }
  for (std::size_t i = 0; i < column.size(); ++i) {
    for (std::size_t row = 0; row < column[i].size(); ++row)
      column[i][row] = (column[i][row] - rows[i][row]) * (p.typical / step);
  }
  return column;
}

double importance(const Problem& problem, const Column& change) {
  const std::size_t n = problem.design.superpixels();
  double largest = 0;
  for (std::size_t i = 0; i < change.size(); ++i) {
    for (std::size_t o = 0; o < observables; ++o) {
      double sum = 0, count = 0;
      for (std::size_t row = o * n; row < (o + 1) * n; ++row) {
        if (std::isinf(problem.data[i].variance[row])) continue;
        sum += change[i][row] * change[i][row];
        ++count;
      }
      if (count > 0) largest = std::max(largest, std::sqrt(sum / count) / least_change[o]);
    }
  }
  return largest;
}

Eigen::MatrixXd weighted_columns(const Problem& problem, const std::vector<double>& rows,
                                 std::span<const Column> columns, std::size_t i) {
  const Observations& data = problem.data[i];
  const auto first = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(rows.size()), first + gram_tail);
  for (std::size_t row = 0; row < rows.size(); ++row) {
    if (std::isinf(data.variance[row])) continue;  // there the columns may have no number
    const auto r = static_cast<Eigen::Index>(row);
    const double weight = 1 / std::sqrt(data.variance[row]);
    for (Eigen::Index c = 0; c < first; ++c) all(r, c) = weight * columns[static_cast<std::size_t>(c)][i][row];
    const std::array<double, gram_tail> tail = {problem.jitter_response(i, row),   problem.offset_response(i, row),
                                                problem.light_response(i, row),    problem.uniform_response(i, row),
                                                problem.contrast_response(i, row), data.value[row] - rows[row]};
    for (Eigen::Index t = 0; t < gram_tail; ++t) all(r, first + t) = weight * tail[static_cast<std::size_t>(t)];
  }
  if (problem.allowed.residue)
    problem.allowed.residue->whiten(i, all.topRows(static_cast<Eigen::Index>(problem.design.superpixels())));
  return all;
}

std::vector<Gram> grams_of(const Problem& problem, const std::vector<std::vector<double>>& rows,
                           std::span<const Column> columns) {
  std::vector<Gram> grams(rows.size());
  tbb::parallel_for(std::size_t{0}, rows.size(), [&](std::size_t i) {
    const Eigen::MatrixXd all = weighted_columns(problem, rows[i], columns, i);
    Gram gram = Gram::Zero(all.cols(), all.cols());
    gram.selfadjointView<Eigen::Lower>().rankUpdate(all.transpose());
    grams[i] = gram.selfadjointView<Eigen::Lower>();
  });
  return grams;
}

}  // namespace tofgraph::diagnosis
