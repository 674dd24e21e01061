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

/// Of what one observable of a condition is off by, along a direction; both in units of the noise.
struct Along {
  double square = 0, product = 0;
};
/// @param direction, off of a row
template <class Direction, class Off> Along along(const Problem& problem, std::size_t condition, std::size_t observable,
                                                  const Direction& direction, const Off& off) {
  const std::size_t n = problem.design.superpixels();
  Along sums;
  for (std::size_t row = observable * n; row < (observable + 1) * n; ++row) {
    const double variance = problem.data[condition].variance[row];
    if (std::isinf(variance)) continue;
    sums.square += direction(row) * direction(row) / variance;
    sums.product += direction(row) * off(row) / variance;
  }
  return sums;
}

}  // namespace

Places places_of(const Problem& problem, const State& state) {
  const auto rows = with_nuisances(problem, expected(problem, state), state.variances);
  Places places{std::vector<double>(rows.size(), 0), state.variances.jitter};
  std::vector<double> sizes;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto light = [&](std::size_t row) { return problem.light_response(i, row); };
    const auto shift = [&](std::size_t row) { return problem.design.shift(i)[row]; };
    const auto off = [&](std::size_t row) { return problem.data[i].value[row] - rows[i][row]; };
    const Along bright = along(problem, i, amplitude, light, off);
    const double prior = state.variances.light * state.variances.light;
    const double brighter = prior * bright.product / (1 + prior * bright.square);  // of ln of its light
    const Along place =
        along(problem, i, distance, shift, [&](std::size_t row) { return off(row) - brighter * light(row); });
    if (!(place.square > 0)) continue;
    places.off[i] = place.product / place.square;
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
