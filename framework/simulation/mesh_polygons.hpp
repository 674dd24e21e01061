// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Polygons of PLY and OBJ files, and their triangles. For this folder only.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::simulation {

using Vertex = std::array<float, 3>;
using TriangleIndices = std::array<std::uint32_t, 3>;

/// Polygons one after the other; each has three corners or more, none of which is beyond the vertices.
struct Polygons {
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> corners;  ///< indices of vertices
  std::vector<std::size_t> ends;       ///< end of each polygon among the corners

  void add(std::span<const std::uint32_t> polygon) {
    corners.insert(corners.end(), polygon.begin(), polygon.end());
    ends.push_back(corners.size());
  }
};

/// Reads the faces and triangle strips of a PLY file, ascii or binary of either byte order.
/// @throws std::runtime_error naming the file and what is wrong with it
Polygons read_ply(const std::filesystem::path& file);

/// Reads the vertices and faces of a Wavefront OBJ file. @throws std::runtime_error likewise, with the line
Polygons read_obj(const std::filesystem::path& file);

/// Cuts a polygon into triangles that cover its own area only, by clipping ears. It may be concave, and may have holes
/// that a doubled edge connects to its outline. Corners on a straight line give no triangle.
/// @returns false when no more ears are found, because the outline crosses itself
bool triangulate(std::span<const Vertex> vertices, std::span<const std::uint32_t> polygon,
                 std::vector<TriangleIndices>& triangles);

/// @throws std::runtime_error "FILE: PROBLEM"
[[noreturn]] void fail_mesh(const std::filesystem::path& file, const std::string& problem);
/// Refuses more faces than max_triangles.
void refuse_too_many(const std::filesystem::path& file, std::uint64_t faces);
/// A coordinate of a vertex. @throws std::runtime_error when it is not finite
void check_vertex(const std::filesystem::path& file, std::size_t index, const Vertex& vertex);
/// The bytes of a file. @throws std::runtime_error
std::string mesh_bytes(const std::filesystem::path& file);

}  // namespace tofgraph::simulation
