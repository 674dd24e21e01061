// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/data/board_window.hpp"

#include "diagnosis/data/search_settings.hpp"

#include "simulation/files/pose.hpp"

#include <algorithm>
#include <cmath>

namespace tofgraph::diagnosis {

std::vector<bool> on_board(const io::Condition& condition, std::span<const simulation::Hit> hits, std::size_t width) {
  const auto& size = *condition.board_size;
  const auto axes = simulation::rotation(condition.board_tilt_x, condition.board_tilt_y, 0);
  const auto roll = simulation::rotation(0, 0, condition.roll);  // back to where the camera is upright
  const std::size_t height = hits.size() / width;
  std::vector<bool> inside(hits.size()), result(hits.size());
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!std::isfinite(hits[i].return_path)) continue;
    const physics::Vector3 point =
        axes.inverse(roll * hits[i].point - physics::Vector3{0, 0, condition.board_distance});
    inside[i] = std::abs(point.x) <= size[0] / 2 && std::abs(point.y) <= size[1] / 2;
  }
  for (std::size_t v = 0; v < height; ++v) {
    for (std::size_t u = 0; u < width; ++u) {
      bool all = true;
      for (std::size_t y = v - std::min(v, settings.outer_margin_px);
           all && y <= std::min(v + settings.outer_margin_px, height - 1); ++y) {
        for (std::size_t x = u - std::min(u, settings.outer_margin_px);
             all && x <= std::min(u + settings.outer_margin_px, width - 1); ++x)
          all = inside[y * width + x];
      }
      result[v * width + u] = all;
    }
  }
  return result;
}

}  // namespace tofgraph::diagnosis
