// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/places.hpp"

#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::diagnosis {
namespace {

constexpr double degrees_of_freedom = 4;
constexpr double hardly_looser = 1.5;  ///< less is as good as not: 2.7 standard deviations off
constexpr double out_of_line = 6;      ///< standard deviations
constexpr double least_off = 3e-3;     ///< m: less is what rails and boards do
constexpr std::size_t enough = 8;      ///< conditions for a median

/// Change of ln of a board's light, as its amplitudes tell. @param rows expected @param sd of most boards
double brightness_of(const Problem& problem, std::size_t condition, const std::vector<double>& rows, double sd) {
  const std::size_t n = problem.design.superpixels();
  double square = 0, product = 0;
  for (std::size_t row = amplitude * n; row < (amplitude + 1) * n; ++row) {
    const double variance = problem.data[condition].variance[row];
    if (std::isinf(variance)) continue;
    const double response = problem.light_response(condition, row);
    square += response * response / variance;
    product += response * (problem.data[condition].value[row] - rows[row]) / variance;
  }
  return sd * sd * product / (1 + sd * sd * square);
}

}  // namespace

Places places_of(const Problem& problem, const State& state) {
  const auto rows = with_nuisances(problem, expected(problem, state), state.variances);
  const std::size_t n = problem.design.superpixels();
  Places places{std::vector<double>(rows.size(), 0), state.variances.jitter};
  std::vector<double> sizes;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double brighter = brightness_of(problem, i, rows[i], state.variances.light);
    double square = 0, product = 0;
    for (std::size_t row = distance * n; row < (distance + 1) * n; ++row) {
      const double variance = problem.data[i].variance[row];
      if (std::isinf(variance)) continue;
      const double shift = problem.design.shift(i)[row];
      const double off = problem.data[i].value[row] - rows[i][row] - brighter * problem.light_response(i, row);
      square += shift * shift / variance;
      product += shift * off / variance;
    }
    if (!(square > 0)) continue;
    places.off[i] = product / square;
    sizes.push_back(std::abs(places.off[i]));
  }
  if (sizes.size() < enough) return places;
  places.sd = physics::sd_of_deviations * physics::median(sizes);
  return places;
}

std::vector<double> looseness_of(const Places& places) {
  std::vector<double> looseness;
  for (const double off : places.off) {
    const double t = off / std::max(places.sd, 1e-6);
    const double times = std::sqrt((degrees_of_freedom + t * t) / (degrees_of_freedom + 1));
    looseness.push_back(times > hardly_looser ? times : 1);
  }
  return looseness;
}

std::vector<Misplaced> misplaced(const Places& places) {
  std::vector<Misplaced> result;
  for (std::size_t i = 0; i < places.off.size(); ++i) {
    if (std::abs(places.off[i]) > std::max(out_of_line * places.sd, least_off)) result.push_back({i, places.off[i]});
  }
  return result;
}

}  // namespace tofgraph::diagnosis
