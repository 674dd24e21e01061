// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Cameras for tests, written down here so that no test depends on a profile.
#pragma once

#include <tofgraph/plugin.h>

#include "physics/lens.hpp"

#include <limits>
#include <vector>

namespace test {

/// A camera that owns its sources and rays.
struct Camera {
  tofgraph_camera view{};
  std::vector<tofgraph_light> lights;
  std::vector<float> rays;

  Camera(const Camera&) = delete;
  Camera(std::uint32_t width, std::uint32_t height, double focal_length, double pitch,
         std::vector<tofgraph_light> sources)
      : lights(std::move(sources)), rays(std::size_t{width} * height * 3) {
    view.size = sizeof view;
    view.light_size = sizeof(tofgraph_light);
    view.name = "test";
    view.width = width;
    view.height = height;
    view.focal_length = focal_length;
    for (int i = 0; i < 2; ++i) {
      view.pitch[i] = pitch;
      view.focal_px[i] = focal_length / pitch;
    }
    view.principal_point[0] = (width - 1) / 2.0;
    view.principal_point[1] = (height - 1) / 2.0;
    view.modulation_frequency = 20e6;
    view.lights = lights.data();
    view.light_count = lights.size();
    view.profile = "";
    make_rays();
  }
  void make_rays() {
    tofgraph::physics::pixel_rays(view, rays.data());
    view.rays = rays.data();
  }
  const float* ray(std::size_t row, std::size_t column) const { return &rays[3 * (row * view.width + column)]; }
};

/// The nominal PMD CamCube 2.0.
inline Camera camcube2(std::vector<tofgraph_light> sources = {{"left", {-0.05, 0, 0}, 1}, {"right", {0.05, 0, 0}, 1}}) {
  return {204, 204, 12.8e-3, 40e-6, std::move(sources)};
}

}  // namespace test
