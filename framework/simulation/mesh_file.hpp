// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Triangles from PLY and OBJ files.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace tofgraph::simulation {

/// Limit beyond which files are rejected: with their search tree more triangles would exhaust the memory.
inline constexpr std::size_t max_triangles = 10'000'000;

struct Triangles {
  std::vector<std::array<float, 3>> vertices;           ///< in the file's unit
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices of vertices; polygons are triangulated
  std::size_t dropped = 0;                              ///< degenerate ones: height below 1e-6 of their length
};

/// @throws std::runtime_error if the file is damaged, announces too many triangles, or has none with an area
Triangles load_triangles(const std::filesystem::path& file);

}  // namespace tofgraph::simulation
