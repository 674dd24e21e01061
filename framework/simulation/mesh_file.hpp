// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Triangles from PLY and OBJ files.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace tofgraph::simulation {

/// More are refused: with their search tree they would fill the memory.
inline constexpr std::size_t max_triangles = 10'000'000;

struct Triangles {
  std::vector<std::array<float, 3>> vertices;           ///< in the file's unit
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices of vertices; polygons are cut into triangles
  std::size_t dropped = 0;                              ///< degenerate ones, whose height is below 1e-6 of their length
};

/// @throws std::runtime_error when the file is damaged, says it has too many triangles, or has none with an area
Triangles load_triangles(const std::filesystem::path& file);

}  // namespace tofgraph::simulation
