// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Polygons of PLY and OBJ files, and their triangulation. Internal to this folder.
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

/// Consecutive polygons; each has at least three corners, with valid vertex indices.
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
/// @throws std::runtime_error naming the file and the problem
Polygons read_ply(const std::filesystem::path& file);

/// Reads the vertices and faces of a Wavefront OBJ file. @throws std::runtime_error naming file, line and problem
Polygons read_obj(const std::filesystem::path& file);

/// Triangulates a polygon by ear clipping. It may be concave, and may have holes that a doubled edge connects to its
/// outline. Corners on a straight line give no triangle.
/// @returns false if no more ears are found, because the outline intersects itself
bool triangulate(std::span<const Vertex> vertices, std::span<const std::uint32_t> polygon,
                 std::vector<TriangleIndices>& triangles);

/// @throws std::runtime_error "FILE: PROBLEM"
[[noreturn]] void fail_mesh(const std::filesystem::path& file, const std::string& problem);
/// Rejects more faces than max_triangles.
void refuse_too_many(const std::filesystem::path& file, std::uint64_t faces);
/// Coordinate of a vertex. @throws std::runtime_error if it is not finite
void check_vertex(const std::filesystem::path& file, std::size_t index, const Vertex& vertex);
/// Content of a file. @throws std::runtime_error
std::string mesh_bytes(const std::filesystem::path& file);

}  // namespace tofgraph::simulation
