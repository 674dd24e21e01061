// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/contribution.hpp"

#include "diagnosis/maps.hpp"
#include "diagnosis/structure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace tofgraph::diagnosis {
namespace {

constexpr int draws = 1000;
constexpr double visible = 25;  ///< chi-square that must be expected where an effect is to prove itself
constexpr double most_of = 0.5;
constexpr double practical_rise = 1e-4;  ///< m
constexpr double practical = 0.05;       ///< least share of the gap that is worth a name

/// A condition in two models.
struct Compared {
  double without = 0, with = 0, expected = 0, freedom = 0;  ///< chi-squares
  double depth_without = 0, depth_with = 0, depths = 0;     ///< m^2, sums over superpixels
};

/// Chi-square of one of the Gram's columns in the covariance: an effect's, or the residual, which is the last.
double square(const Gram& gram, Eigen::Index column, const Variances& variances) {
  double determinant = 0;
  return marginal(gram, variances, determinant)(column, column);
}

std::vector<Compared> compare(const Problem& problem, const State& with, const State& without,
                              const std::vector<bool>& held) {
  const auto rows = expected(problem, with), other = expected(problem, without);
  const Column apart = difference(rows, other);
  const std::vector<Gram> one = grams_of(problem, rows, std::span(&apart, 1)),
                          two = grams_of(problem, other, std::span(&apart, 1));
  const std::size_t n = problem.design.superpixels();
  std::vector<Compared> result;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!held[i]) continue;
    Compared c;
    c.with = square(one[i], one[i].cols() - 1, with.variances);
    c.without = square(two[i], two[i].cols() - 1, with.variances);
    c.expected = square(one[i], 0, with.variances);
    const Observations& data = problem.data[i];
    c.freedom = static_cast<double>(std::ranges::count_if(data.variance, [](double v) { return std::isfinite(v); }));
    for (std::size_t r = distance * n; r < (distance + 1) * n; ++r) {
      if (std::isinf(data.variance[r])) continue;
      const double depth = 1 / problem.design.shift(i)[r];
      c.depth_with += std::pow(depth * (data.value[r] - rows[i][r]), 2);
      c.depth_without += std::pow(depth * (data.value[r] - other[i][r]), 2);
      ++c.depths;
    }
    result.push_back(c);
  }
  return result;
}

double depth_rise(const Compared& sum) {
  return sum.depths > 0 ? std::sqrt(sum.depth_with / sum.depths) - std::sqrt(sum.depth_without / sum.depths) : 0;
}

void add(Compared& sum, const Compared& c) {
  sum.without += c.without, sum.with += c.with, sum.expected += c.expected, sum.freedom += c.freedom;
  sum.depth_without += c.depth_without, sum.depth_with += c.depth_with, sum.depths += c.depths;
}

}  // namespace

HeldOutFall held_out_fall(const Problem& problem, const State& with, const State& without,
                          const std::vector<bool>& held, std::uint64_t seed) {
  std::vector<double> trained;
  for (const bool aside : held) trained.push_back(aside ? 0 : 1);
  const std::vector<double> all(held.size(), 1);
  State full = fit_nuisances(problem, fit(problem, with_maps_of(problem, with, trained), trained).state, all).state;
  Problem dimmed = problem;
  brighten(dimmed, without);
  const State less =
      fit_nuisances(dimmed, fit(dimmed, with_maps_of(dimmed, without, trained), trained).state, all).state;
  full.variances = with.variances;
  const std::vector<Compared> conditions = compare(problem, full, less, held);
  HeldOutFall result;
  result.conditions = conditions.size();
  if (conditions.empty()) return result;
  Compared sum;
  double squares = 0;
  for (const Compared& c : conditions) {
    add(sum, c);
    squares += c.expected * c.expected;
  }
  result.expected = sum.expected;
  result.fall = sum.without - sum.with;
  result.excess = sum.without - sum.freedom;
  result.carriers = sum.expected * sum.expected / std::max(squares, 1e-300);
  result.depth_rise = depth_rise(sum);
  std::mt19937_64 generator(seed);
  std::vector<double> falls, rises;
  for (int d = 0; d < draws; ++d) {
    Compared drawn;
    for (std::size_t k = 0; k < conditions.size(); ++k) add(drawn, conditions[generator() % conditions.size()]);
    falls.push_back(drawn.without - drawn.with);
    rises.push_back(depth_rise(drawn));
  }
  std::ranges::sort(falls);
  std::ranges::sort(rises);
  result.low = falls[draws / 40];
  result.depth_rise_low = rises[draws / 40];
  return result;
}

std::string refuted(const HeldOutFall& fall) {
  if (fall.expected < visible) return "";
  if (fall.depth_rise_low > practical_rise)
    return fmt::format("on conditions that were put aside the gap of depth grows by {:.2f} mm", 1e3 * fall.depth_rise);
  // Chi-squares go with the square of the gap.
  const double left = std::sqrt(std::max(fall.excess - fall.fall, 0.0) / std::max(fall.excess, 1e-300));
  // Where few conditions carry it, drawing says little: then it must be most of what is there.
  const bool falls = fall.low > 0 || (fall.carriers < few && fall.fall > std::max(certain, most_of * fall.excess));
  if (falls && (fall.excess <= 0 || left < 1 - practical)) return "";
  return fmt::format(
      "the gap does not shrink on conditions that were put aside (chi-square beyond noise {:.0f}, with it {:.0f})",
      fall.excess, fall.excess - fall.fall);
}

bool hardly_differ(const Problem& problem, const State& one, const State& other, double limit) {
  const Variances& sd = one.variances;
  Column apart = difference(expected(problem, other), expected(problem, one));
  double square = 0;
  for (std::size_t i = 0; i < apart.size(); ++i) {
    const auto taken = take_out_jitter(problem, i, apart[i]);
    square += std::pow(taken(0) + taken(1), 2) / (sd.jitter * sd.jitter + sd.offset * sd.offset) +
              std::pow(taken(2) / sd.light, 2);
  }
  return square < limit && importance(problem, apart) < 1;
}

std::vector<Column> signature(const Problem& problem, const State& without, const State& with, const Piece& piece) {
  State state = without;
  const Term& term = with.terms[piece.term];
  const std::span<const double> values = values_of(term, piece);
  std::size_t at = state.terms.size(), first = 0;
  if (piece.refinement) {
    at = piece.term;
    state.terms[at] = refined(state.terms[at], *piece.refinement, values);
    first = state.terms[at].candidate->place(*piece.refinement);
  } else {
    state.terms.push_back(term);
  }
  const auto rows = expected(problem, state);
  std::vector<Column> columns = {difference(rows, expected(problem, without))};
  for (std::size_t k = first; k < first + values.size(); ++k)
    columns.push_back(derivative(problem, state, rows, at, k));
  return columns;
}

}  // namespace tofgraph::diagnosis
