// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Individual properties of a camera's pixels.
#include "tests/hidden_effects/campaign.hpp"
#include "tests/hidden_effects/draws.hpp"

#include <cmath>

namespace tofgraph::hidden {

PixelMaps draw_maps(const Camera& camera, std::uint64_t seed) {
  std::mt19937_64 random = generator(seed, maps_draw);
  std::normal_distribution<double> normal;
  const auto draw = [&](std::size_t count, double sd) {
    Image values(count);
    for (double& value : values) value = sd * normal(random);
    return values;
  };
  const std::size_t width = static_cast<std::size_t>(camera.width), height = static_cast<std::size_t>(camera.height);
  const Image rows = draw(height, 1.5e-3), columns = draw(width, 2e-3);
  PixelMaps maps;
  maps.fixed_pattern = draw(camera.pixels(), 3e-3);
  maps.fixed_pattern_slope.assign(camera.pixels(), 0.0);
  maps.response = draw(camera.pixels(), 0.02);
  maps.dark = draw(camera.pixels(), 2);
  maps.dark_rate = draw(camera.pixels(), 500);
  for (std::size_t i = 0; i < camera.pixels(); ++i) {
    const double x = static_cast<double>(i % width) / 102.0 - 1, y = static_cast<double>(i / width) / 102.0 - 1;
    maps.fixed_pattern[i] += rows[i / width] + columns[i % width] + 4e-3 * std::sin(3 * x + 2 * y);
    maps.dark[i] += 30;
    maps.dark_rate[i] = std::abs(maps.dark_rate[i]);
  }
  return maps;
}

}  // namespace tofgraph::hidden
