// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/contrast.hpp"

#include "diagnosis/standing.hpp"

#include <algorithm>
#include <cmath>

namespace tofgraph::diagnosis {

bool MeasuredContrast::profile_is_off() const {
  constexpr double close = 0.01;
  return (profile < low || profile > high) && std::abs(value / profile - 1) > close;
}

std::string MeasuredContrast::text() const { return with_uncertainty(value, {low, high}, ""); }

std::optional<MeasuredContrast> contrast_of(const Problem& problem, const State& state, double lack_of_fit) {
  const auto& sd = problem.nuisances.sd;
  const auto contrast = std::ranges::find(sd, &Variances::contrast);
  if (contrast == sd.end()) return std::nullopt;
  const auto rows = expected(problem, state);
  const std::vector<Column> columns = own_columns(problem, state, rows);
  const Unknowns unknowns = problem.unknowns(columns.size());
  const Solution solution = least_squares(problem, rows, columns, unknowns, state.variances);
  const Eigen::Index at = unknowns.effects + unknowns.targets + (contrast - sd.begin());
  const double half = 1.96 * std::sqrt(solution.covariance(at, at) * std::max(lack_of_fit, 1.0));
  const double profile = problem.design.camera().contrast, lower = solution.values(at);  // as much more intensity
  return MeasuredContrast{profile, profile * std::exp(-lower), profile * std::exp(-lower - half),
                          profile * std::exp(-lower + half)};
}

}  // namespace tofgraph::diagnosis
