// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Correction of effects that depend on neighbouring pixels, over the whole image.
#include "simulation/correction_views.hpp"

#include <cmath>

namespace tofgraph::simulation {

/// F(z) is the measured light if the light without effects is z. Solves F(z) = seen by the fixed-point iteration
/// z += (seen - F(z)) / q, where q = seen / z_0 is the change of a pixel's light by the effects without neighbours.
std::vector<std::uint32_t> Correction::undo_images(const FrameSettings& settings, std::span<const float> measured,
                                                   std::span<const float> amplitude, std::span<float> distance) const {
  const Acquisition acquisition = acquisition_for(camera_->view(), settings);
  const double range = images_->range(acquisition), per_metre = physics::two_pi / range;
  const std::size_t n = distance.size();
  PhasorImage seen(n), light(n), ratio(n);
  for (std::size_t i = 0; i < n; ++i) {
    if (!std::isfinite(distance[i]) || !(amplitude[i] > 0)) continue;
    seen[i] = std::polar<double>(amplitude[i], per_metre * measured[i]);
    light[i] = std::polar<double>(amplitude[i], per_metre * distance[i]);
    ratio[i] = seen[i] / light[i];
  }
  constexpr int max_steps = 12;
  constexpr double settled = 3e-6;  // relative to the light: 4 um at 20 MHz
  std::vector<std::uint32_t> open;
  for (int step = 0; step <= max_steps; ++step) {
    const PhasorImage now = look(*images_, acquisition, images_->pixels(), light);
    open.clear();
    for (std::size_t i = 0; i < n; ++i) {
      if (seen[i] == std::complex<double>{}) continue;
      const std::complex<double> rest = seen[i] - now[i];
      if (!(std::abs(rest) < settled * std::abs(seen[i]))) open.push_back(static_cast<std::uint32_t>(i));
      if (step < max_steps) light[i] += rest / ratio[i];
    }
    if (open.empty()) break;
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (seen[i] == std::complex<double>{}) continue;
    const double change = std::remainder(std::arg(light[i]) / per_metre - distance[i], range);
    distance[i] += static_cast<float>(change);
  }
  return open;
}

}  // namespace tofgraph::simulation
