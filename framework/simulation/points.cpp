// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/points.hpp"

#include <algorithm>

namespace tofgraph::simulation {
namespace {

/// True if a pixel and a neighbour see different surfaces: another object or reflectivity, a crease or a step.
bool differ(const Hit& a, const Hit& b) {
  const bool there = std::isfinite(a.return_path);
  if (there != std::isfinite(b.return_path)) return true;
  if (!there) return false;
  return a.object != b.object || a.reflectivity != b.reflectivity || physics::dot(a.normal, b.normal) < 0.95 ||
         std::abs(a.return_path - b.return_path) > 0.03 * std::min(a.return_path, b.return_path);
}

}  // namespace

std::vector<std::size_t> edge_pixels(const std::vector<Hit>& hits, std::size_t rows, std::size_t columns) {
  std::vector<char> on_edge(hits.size(), 0);
  bool any = false;
  const auto compare = [&](std::size_t i, std::size_t j) {
    if (!differ(hits[i], hits[j])) return;
    on_edge[i] = on_edge[j] = 1;
    any = true;
  };
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t c = 0; c < columns; ++c) {
      const std::size_t i = r * columns + c;
      if (c + 1 < columns) compare(i, i + 1);
      if (r + 1 < rows) compare(i, i + columns);
    }
  }
  std::vector<std::size_t> edges;
  for (std::size_t i = 0; any && i < hits.size(); ++i) {
    if (on_edge[i] != 0) edges.push_back(i);
  }
  return edges;
}

}  // namespace tofgraph::simulation
