// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/forward_model.hpp"

#include <tofgraph/physics/lens.hpp>

namespace tofgraph::simulation {
namespace {

Pixels grid(const tofgraph_camera& camera, std::size_t rows, std::size_t columns, double height, double width) {
  Pixels pixels{rows, columns, (height + width) / 2, {}, {}};
  const physics::Lens lens(camera);
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t c = 0; c < columns; ++c) {
      const double u = (static_cast<double>(c) + 0.5) * width - 0.5, v = (static_cast<double>(r) + 0.5) * height - 0.5;
      pixels.at.insert(pixels.at.end(), {u, v});
      const auto p = physics::image_point(camera, lens, u, v);
      const Vector3 along = p ? Vector3{p->x, p->y, 1} : Vector3{io::unknown, io::unknown, io::unknown};
      pixels.rays.push_back((1 / physics::norm(along)) * along);
    }
  }
  return pixels;
}

}  // namespace

Pixels whole_image(const tofgraph_camera& camera) { return grid(camera, camera.height, camera.width, 1, 1); }

Pixels superpixels(const tofgraph_camera& camera, std::size_t rows, std::size_t columns) {
  return grid(camera, rows, columns, static_cast<double>(camera.height) / static_cast<double>(rows),
              static_cast<double>(camera.width) / static_cast<double>(columns));
}

Acquisition acquisition_of(const tofgraph_camera& camera, double integration_time) {
  Acquisition acquisition;
  acquisition.condition = {sizeof(tofgraph_condition),
                           0,
                           "",
                           "dark",
                           integration_time,
                           camera.modulation_frequency,
                           io::unknown,
                           io::unknown,
                           io::unknown,
                           {0, 0},
                           0,
                           io::unknown};
  return acquisition;
}

}  // namespace tofgraph::simulation
