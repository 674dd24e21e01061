// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/noise_pixels.hpp"

#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::calibration {
namespace {

constexpr double deviations = 6;      ///< from which on a pixel is another one: one in 5e8 by chance
constexpr double min_noisy = 1.25;    ///< its noise over the fit's: less is not worth losing a pixel
constexpr double max_stuck = 0.5;     ///< a pixel that hardly moves
constexpr double min_response = 0.2;  ///< relative difference to the neighbours
constexpr std::size_t few = 3;        ///< conditions: with fewer an edge of the scene looks like a bad pixel
constexpr std::ptrdiff_t reach = 2;   ///< px, of the neighbourhood

/// ln of the level over the median of the neighbours.
double against_neighbours(const NoiseData& data, const std::vector<float>& level, std::size_t pixel) {
  const auto columns = static_cast<std::ptrdiff_t>(data.columns), rows = static_cast<std::ptrdiff_t>(data.rows);
  const auto u = static_cast<std::ptrdiff_t>(pixel) % columns, v = static_cast<std::ptrdiff_t>(pixel) / columns;
  std::vector<double> around;
  for (std::ptrdiff_t y = std::max<std::ptrdiff_t>(v - reach, 0); y <= std::min(v + reach, rows - 1); ++y) {
    for (std::ptrdiff_t x = std::max<std::ptrdiff_t>(u - reach, 0); x <= std::min(u + reach, columns - 1); ++x) {
      const float value = level[static_cast<std::size_t>(y * columns + x)];
      if ((x != u || y != v) && value > 0) around.push_back(value);
    }
  }
  return std::log(level[pixel] / physics::median(around));
}

}  // namespace

void mark_response(const NoiseData& data, NoiseFit& fit) {
  std::vector<double> response(fit.bad.size(), unknown), sizes;
  for (std::size_t i = 0; i < fit.bad.size(); ++i) {
    std::vector<double> differences;
    for (const NoiseCondition& c : data.conditions) {
      if (c.flat && c.pixels.level[i] > 0) differences.push_back(against_neighbours(data, c.pixels.level, i));
    }
    if (differences.size() < few) continue;
    response[i] = physics::median(differences);
    if (std::isfinite(response[i])) sizes.push_back(std::abs(response[i]));
  }
  const double limit =
      std::max(deviations * physics::sd_of_deviations * physics::median(sizes), std::log1p(min_response));
  for (std::size_t i = 0; i < fit.bad.size(); ++i) {
    if (std::abs(response[i]) > limit) fit.bad[i] |= bad_response;
  }
}

void mark_noise(const NoiseData& data, NoiseFit& fit) {
  fit.ratio.assign(fit.bad.size(), unknown);
  const double read = fit.noise.read_noise * fit.noise.read_noise;
  for (std::size_t i = 0; i < fit.bad.size(); ++i) {
    double sum = 0, freedom = 0;
    for (const NoiseCondition& c : data.conditions) {
      if (!std::isfinite(c.pixels.variance[i])) continue;
      sum += c.pixels.samples * c.pixels.variance[i] / (read + fit.noise.shot_noise * c.pixels.level[i]);
      freedom += c.pixels.samples;
    }
    fit.bad[i] &= static_cast<std::uint8_t>(~(bad_noisy | bad_stuck));
    if (freedom == 0) continue;
    const double ratio = sum / freedom, chance = deviations * std::sqrt(2 / freedom);
    fit.ratio[i] = std::sqrt(ratio);
    if (ratio > 1 + chance && fit.ratio[i] > min_noisy) fit.bad[i] |= bad_noisy;
    if (ratio < 1 - std::min(chance, 0.9) && fit.ratio[i] < max_stuck) fit.bad[i] |= bad_stuck;
  }
}

}  // namespace tofgraph::calibration
