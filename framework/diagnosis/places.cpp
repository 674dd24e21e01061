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

}  // namespace

Places places_of(const Problem& problem, const State& state) {
  const auto rows = with_nuisances(problem, expected(problem, state), state.variances);
  Places places{std::vector<double>(rows.size(), 0), state.variances.jitter};
  std::vector<double> sizes;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    // Of a board that is brighter than its target usually is, light from elsewhere changes the distance less. How
    // bright it is, amplitudes tell; where it stands, they do not.
    const double light = state.variances.light;
    double shifts = 0, shift_light = 0, lights = light > 0 ? 1 / (light * light) : 1, product = 0, light_product = 0;
    for (std::size_t row = 0; row < rows[i].size(); ++row) {
      const double variance = problem.data[i].variance[row];
      if (std::isinf(variance)) continue;
      const double shift = problem.is_of(distance, row) ? problem.design.shift(i)[row] : 0;
      const double brighter = light > 0 ? problem.light_response(i, row) : 0;
      const double off = problem.data[i].value[row] - rows[i][row];
      shifts += shift * shift / variance, shift_light += shift * brighter / variance;
      lights += brighter * brighter / variance;
      product += shift * off / variance, light_product += brighter * off / variance;
    }
    if (!(shifts > 0)) continue;
    places.off[i] = (product - shift_light * light_product / lights) / (shifts - shift_light * shift_light / lights);
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
