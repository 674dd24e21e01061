// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/board_offsets.hpp"

#include "diagnosis/data/search_settings.hpp"

#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::diagnosis {
namespace {

/// Projection of one observable's residual in a condition on a direction; both in units of the noise.
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

BoardOffsets board_offsets_of(const Problem& problem, const State& state) {
  const auto rows = with_nuisances(problem, state, expected(problem, state));
  BoardOffsets offsets{std::vector<double>(rows.size(), 0), state.random_sd.jitter};
  std::vector<double> magnitudes;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto light = [&](std::size_t row) { return state.light_response(problem, i, row); };
    const auto shift = [&](std::size_t row) { return problem.design.shift(i)[row]; };
    const auto off = [&](std::size_t row) { return problem.data[i].value[row] - rows[i][row]; };
    const Along bright = along(problem, i, amplitude, light, off);
    const double prior = state.random_sd.light * state.random_sd.light;
    const double brighter = prior * bright.product / (1 + prior * bright.square);  // of ln of its light
    const Along place =
        along(problem, i, distance, shift, [&](std::size_t row) { return off(row) - brighter * light(row); });
    if (!(place.square > 0)) continue;
    offsets.error[i] = place.product / place.square;
    magnitudes.push_back(std::abs(offsets.error[i]));
  }
  if (magnitudes.size() < settings.misplaced_min_conditions) return offsets;
  offsets.sd = physics::sd_of_deviations * physics::median(magnitudes);
  return offsets;
}

std::vector<double> jitter_scale_of(const BoardOffsets& offsets) {
  std::vector<double> jitter_scale;
  for (const double off : offsets.error) {
    const double t = off / std::max(offsets.sd, 1e-6);
    const double times = std::sqrt((settings.board_offset_freedom + t * t) / (settings.board_offset_freedom + 1));
    jitter_scale.push_back(times > settings.min_jitter_scale ? times : 1);
  }
  return jitter_scale;
}

std::vector<Misplaced> misplaced(const BoardOffsets& offsets) {
  std::vector<Misplaced> result;
  for (std::size_t i = 0; i < offsets.error.size(); ++i) {
    if (std::abs(offsets.error[i]) > std::max(settings.misplaced_sd * offsets.sd, settings.misplaced_distance))
      result.push_back({i, offsets.error[i]});
  }
  return result;
}

}  // namespace tofgraph::diagnosis
