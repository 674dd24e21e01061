// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/mesh_file.hpp"

#include "config/paths.hpp"
#include "simulation/mesh_polygons.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace tofgraph::simulation {
namespace {

std::array<double, 3> edge(const Vertex& from, const Vertex& to) {
  return {double{to[0]} - from[0], double{to[1]} - from[1], double{to[2]} - from[2]};
}

double square(const std::array<double, 3>& v) { return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]; }

/// Triangle that is too thin for its plane to be determined.
bool degenerate(const Vertex& a, const Vertex& b, const Vertex& c) {
  const auto u = edge(a, b), v = edge(a, c), w = edge(b, c);
  const std::array<double, 3> normal = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                                        u[0] * v[1] - u[1] * v[0]};
  const double max_length = std::max({square(u), square(v), square(w)});
  return !(std::sqrt(square(normal)) > 1e-6 * max_length);
}

void add_triangle(const TriangleIndices& t, Triangles& result) {
  if (degenerate(result.vertices[t[0]], result.vertices[t[1]], result.vertices[t[2]]))
    ++result.dropped;
  else
    result.triangles.push_back(t);
}

}  // namespace

void fail_mesh(const std::filesystem::path& file, const std::string& problem) {
  throw std::runtime_error(fmt::format("{}: {}", file.string(), problem));
}

void refuse_too_many(const std::filesystem::path& file, std::uint64_t faces) {
  if (faces > max_triangles)
    fail_mesh(file, fmt::format("it has {} faces, but at most {} are read: simplify the mesh", faces, max_triangles));
}

void check_vertex(const std::filesystem::path& file, std::size_t index, const Vertex& vertex) {
  if (!std::isfinite(vertex[0]) || !std::isfinite(vertex[1]) || !std::isfinite(vertex[2]))
    fail_mesh(file, fmt::format("its vertex {} is not a finite point", index));
}

std::string mesh_bytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) fail_mesh(file, "it cannot be read");
  return {std::istreambuf_iterator<char>(in), {}};
}

Triangles load_triangles(const std::filesystem::path& file) {
  Polygons polygons = config::lower_case_ending(file) == ".ply" ? read_ply(file) : read_obj(file);
  Triangles result;
  result.vertices = std::move(polygons.vertices);
  std::vector<TriangleIndices> pieces;
  for (std::size_t i = 0, begin = 0; i < polygons.ends.size(); begin = polygons.ends[i++]) {
    const std::span polygon = std::span(polygons.corners).subspan(begin, polygons.ends[i] - begin);
    if (polygon.size() == 3) {
      add_triangle({polygon[0], polygon[1], polygon[2]}, result);
      continue;
    }
    pieces.clear();
    if (!triangulate(result.vertices, polygon, pieces))
      fail_mesh(file,
                fmt::format("its face {} with {} corners cannot be cut into triangles: its outline crosses itself", i,
                            polygon.size()));
    result.dropped += pieces.empty() ? polygon.size() - 2 : 0;
    for (const TriangleIndices& piece : pieces) add_triangle(piece, result);
    refuse_too_many(file, result.triangles.size());
  }
  if (result.triangles.empty()) {
    fail_mesh(file, result.dropped == 0
                        ? std::string("it has no faces, so it has no surface")
                        : fmt::format("all its {} triangles are degenerate: they have no area", result.dropped));
  }
  return result;
}

}  // namespace tofgraph::simulation
