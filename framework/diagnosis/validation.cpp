// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/validation.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <random>

namespace tofgraph::diagnosis {
namespace {

constexpr double held_out_share =
    0.25;  ///< of the conditions, about: fewer levels of each setting, where there are several
constexpr std::size_t fewest_levels = 4;
constexpr int draws = 500;

/// Conditions by the level of a setting, and those levels that may be held out: the first and the last stay.
struct Setting {
  std::vector<std::vector<std::size_t>> inner;
  std::size_t levels = 0;
};

template <class Key> void add_setting(const Design& design, const std::function<Key(const io::Condition&)>& level_of,
                                      std::vector<Setting>& settings) {
  std::map<Key, std::vector<std::size_t>> levels;
  for (std::size_t i = 0; i < design.size(); ++i) levels[level_of(design.conditions()[i])].push_back(i);
  if (levels.size() < fewest_levels) return;
  Setting setting{{}, levels.size()};
  for (auto it = std::next(levels.begin()); it != std::prev(levels.end()); ++it)
    setting.inner.push_back(std::move(it->second));
  settings.push_back(std::move(setting));
}

/// Calls f(condition, superpixel, row) where the observable is known.
template <class F>
void for_each_known(const Problem& problem, std::size_t observable, const std::vector<bool>& chosen, F f) {
  const std::size_t n = problem.design.superpixels();
  for (std::size_t i = 0; i < problem.data.size(); ++i) {
    if (!chosen[i]) continue;
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

std::vector<bool> hold_out(const Design& design, std::uint64_t seed) {
  std::vector<Setting> settings;
  add_setting<double>(
      design, [](const io::Condition& c) { return c.board_distance; }, settings);
  add_setting<double>(
      design, [](const io::Condition& c) { return c.integration_time; }, settings);
  add_setting<std::string>(
      design, [](const io::Condition& c) { return c.target; }, settings);
  std::vector<bool> held(design.size(), false);
  std::mt19937_64 generator(seed);
  const double share = 1 - std::pow(1 - held_out_share, 1 / std::max(static_cast<double>(settings.size()), 1.0));
  for (Setting& setting : settings) {
    const auto wanted = static_cast<std::size_t>(std::lround(share * static_cast<double>(setting.levels)));
    for (std::size_t k = 0; k < std::max<std::size_t>(wanted, 1) && !setting.inner.empty(); ++k) {
      const auto pick = static_cast<std::ptrdiff_t>(generator() % setting.inner.size());
      std::vector<bool> more = held;
      for (const std::size_t i : setting.inner[static_cast<std::size_t>(pick)]) more[i] = true;
      if (static_cast<std::size_t>(std::ranges::count(more, false)) >= fewest_conditions) held = std::move(more);
      setting.inner.erase(setting.inner.begin() + pick);
    }
  }
  return held;
}

double gap(const Problem& problem, const State& state, std::size_t observable, const std::vector<bool>& chosen) {
  const auto rows = expected(problem, state);
  double sum = 0, count = 0;
  for_each_known(problem, observable, chosen, [&](std::size_t i, std::size_t, std::size_t row) {
    const double left = (problem.data[i].value[row] - rows[i][row]) * scale_of(problem, observable, i, row);
    sum += left * left;
    ++count;
  });
  return std::sqrt(sum / count);
}

double noise_floor(const Problem& problem, const State& state, std::size_t observable,
                   const std::vector<bool>& chosen) {
  double sum = 0, count = 0;
  for_each_known(problem, observable, chosen, [&](std::size_t i, std::size_t, std::size_t row) {
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
