// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/lab_limit.hpp"

#include "tests/hidden_effects/plain_geometry.hpp"

#include <cmath>

namespace tofgraph::hidden {
namespace {

/// Depths of the board along the pixel rays, from the sensor plane, m.
Image depths_of(const Physics& physics, const View& view) {
  const Vector lens{0, 0, physics.camera.focal_length};
  const Plane plane = board_of(physics, view, 0);
  Image depths;
  for (const Ray& ray : rays_of(physics))
    depths.push_back(lens.z +
                     dot(plane.point - lens, plane.normal) / dot(ray.direction, plane.normal) * ray.direction.z);
  return depths;
}

}  // namespace

NoiseLimit noise_limit(const Physics& physics, const View& view, const std::vector<Defect>& defects) {
  constexpr double step = 1e-4;  // m
  View behind = view;
  behind.distance += step;
  const Taps taps = expected_taps(physics, view);
  const PhasorImage here = light_on_sensor(physics, view, 0).phasor, there = light_on_sensor(physics, behind, 0).phasor;
  const Image depth = depths_of(physics, view), further = depths_of(physics, behind);
  const Camera& camera = physics.camera;
  double shot = 0, all = 0, used = 0;
  for (std::size_t i = 0; i < camera.pixels(); ++i) {
    if (defects[i] != Defect::none) continue;
    const auto difference = [&](std::size_t k) { return taps.a[k][i] - taps.b[k][i]; };
    const auto light = [&](std::size_t k) { return taps.a[k][i] + taps.b[k][i]; };
    const double x = difference(0) - difference(2), y = difference(3) - difference(1);
    const double square = x * x + y * y, rise = std::arg(there[i] / here[i]) / (further[i] - depth[i]);
    // psi = atan2(y, x): its variance from those of x and y.
    const auto variance = [&](double of_x, double of_y) {
      return (y * y * of_x + x * x * of_y) / (square * square) / (rise * rise);
    };
    const double by_light =
        variance(camera.shot_noise * (light(0) + light(2)), camera.shot_noise * (light(1) + light(3)));
    const double read = 4 * camera.read_noise * camera.read_noise;
    shot += by_light;
    all += by_light + variance(read, read);
    ++used;
  }
  return {std::sqrt(shot / used), std::sqrt(all / used)};
}

}  // namespace tofgraph::hidden
