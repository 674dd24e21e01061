// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/validation.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace tofgraph::diagnosis {
namespace {

constexpr int draws = 500;

/// Calls f(condition, superpixel, row) where the observable is known.
template <class F> void for_each_known(const Problem& problem, std::size_t observable, F f) {
  const std::size_t n = problem.design.superpixels();
  for (std::size_t i = 0; i < problem.data.size(); ++i) {
    for (std::size_t s = 0; s < n; ++s) {
      if (!std::isinf(problem.data[i].variance[observable * n + s])) f(i, s, observable * n + s);
    }
  }
}

/// Half paths become depths.
double scale_of(const Problem& problem, std::size_t observable, std::size_t i, std::size_t row) {
  return observable == distance ? 1 / problem.design.shift(i)[row] : 1;
}

}  // namespace

double gap(const Problem& problem, const State& state, std::size_t observable) {
  const auto rows = expected(problem, state);
  double sum = 0, count = 0;
  for_each_known(problem, observable, [&](std::size_t i, std::size_t, std::size_t row) {
    const double left = (problem.data[i].value[row] - rows[i][row]) * scale_of(problem, observable, i, row);
    sum += left * left;
    ++count;
  });
  return std::sqrt(sum / count);
}

double noise_floor(const Problem& problem, const State& state, std::size_t observable) {
  double sum = 0, count = 0;
  for_each_known(problem, observable, [&](std::size_t i, std::size_t, std::size_t row) {
    const double scale = scale_of(problem, observable, i, row);
    const double jitter = state.variances.jitter * problem.design.shift(i)[row];
    const double offset = state.variances.offset * problem.offset_response(i, row);
    const double light = state.variances.light * problem.light_response(i, row);
    sum += scale * scale * (problem.data[i].variance[row] + jitter * jitter + offset * offset + light * light);
    ++count;
  });
  return std::sqrt(sum / count);
}

std::vector<Interval> intervals(const Problem& problem, const Fit& fit, std::uint64_t seed) {
  const auto rows = expected(problem, fit.state);
  const std::vector<Column> columns = own_columns(problem, fit.state, rows);
  const Unknowns unknowns = problem.unknowns(columns.size());
  std::vector<Gram> grams = grams_of(problem, rows, columns);
  std::vector<double> determinants(grams.size());
  for (std::size_t i = 0; i < grams.size(); ++i) grams[i] = marginal(grams[i], fit.state.variances, determinants[i]);
  std::vector<double> weight(grams.size(), 1.0);
  const Solution whole = solve(assemble(grams, determinants, unknowns, weight), unknowns.effects);
  std::mt19937_64 generator(seed);
  std::vector<std::vector<double>> drawn(columns.size());
  for (int d = 0; d < draws; ++d) {
    std::ranges::fill(weight, 0.0);
    for (std::size_t k = 0; k < grams.size(); ++k) ++weight[generator() % grams.size()];
    const Solution one = solve(assemble(grams, determinants, unknowns, weight), unknowns.effects);
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const auto j = static_cast<Eigen::Index>(c);
      drawn[c].push_back(one.values(j) - whole.values(j));
    }
  }
  std::vector<Interval> result;
  std::size_t c = 0;
  for (const Term& term : fit.state.terms) {
    for (std::size_t k = 0; k < term.values.size(); ++k, ++c) {
      std::ranges::sort(drawn[c]);
      const double likely =
          1.96 * std::sqrt(whole.covariance(static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(c)));
      const double below = std::min(drawn[c][draws / 40], -likely),
                   above = std::max(drawn[c][draws - 1 - draws / 40], likely);
      const double unit = std::abs(term.candidate->free()[k].typical);
      result.push_back({term.values[k] + unit * below, term.values[k] + unit * above});
    }
  }
  return result;
}

}  // namespace tofgraph::diagnosis
