// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/mesh_file.hpp"

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>
#include <assimp/Importer.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace tofgraph::simulation {
namespace {

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& problem) {
  throw std::runtime_error(fmt::format("{}: {}", file.string(), problem));
}

void refuse_too_many(const std::filesystem::path& file, std::size_t faces) {
  if (faces > most_triangles)
    fail(file, fmt::format("it has {} faces, and at most {} are read: simplify the mesh", faces, most_triangles));
}

/// The elements that a PLY header announces, before a reader makes room for them. One takes at least a byte.
void check_ply_header(const std::filesystem::path& file, std::istream& in) {
  const std::uintmax_t bytes = std::filesystem::file_size(file);
  std::string line;
  for (int lines = 0; lines < 1000 && std::getline(in, line) && !line.starts_with("end_header"); ++lines) {
    std::istringstream words(line);
    std::string keyword, element;
    std::uint64_t count = 0;
    if (!(words >> keyword >> element) || keyword != "element") continue;
    if (!(words >> count)) fail(file, fmt::format("its header has no count in '{}'", line));
    if (element == "face") refuse_too_many(file, count);
    if (count > bytes)
      fail(file, fmt::format("its header announces {} of '{}', but the file has only {} bytes", count, element, bytes));
  }
}

void count_obj_faces(const std::filesystem::path& file, std::istream& in) {
  std::size_t faces = 0;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("f ") || line.starts_with("f\t")) ++faces;
  }
  refuse_too_many(file, faces);
}

void check_announced(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) fail(file, "it cannot be read");
  if (file.extension() == ".ply")
    check_ply_header(file, in);
  else
    count_obj_faces(file, in);
}

using Vertex = std::array<float, 3>;

std::array<double, 3> edge(const Vertex& from, const Vertex& to) {
  return {double{to[0]} - from[0], double{to[1]} - from[1], double{to[2]} - from[2]};
}

double square(const std::array<double, 3>& v) { return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]; }

/// A triangle so thin that its plane is not known.
bool degenerate(const Vertex& a, const Vertex& b, const Vertex& c) {
  const auto u = edge(a, b), v = edge(a, c), w = edge(b, c);
  const std::array<double, 3> normal = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                                        u[0] * v[1] - u[1] * v[0]};
  const double longest = std::max({square(u), square(v), square(w)});
  return !(std::sqrt(square(normal)) > 1e-6 * longest);
}

void append(const std::filesystem::path& file, const aiMesh& mesh, Triangles& result) {
  const auto first = static_cast<std::uint32_t>(result.vertices.size());
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
    const aiVector3D& v = mesh.mVertices[i];
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
      fail(file, fmt::format("its vertex {} is no finite point", i));
    result.vertices.push_back({v.x, v.y, v.z});
  }
  for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
    const aiFace& face = mesh.mFaces[i];
    if (face.mNumIndices != 3) continue;  // points and lines have no surface
    const std::array<std::uint32_t, 3> t = {first + face.mIndices[0], first + face.mIndices[1],
                                            first + face.mIndices[2]};
    if (degenerate(result.vertices[t[0]], result.vertices[t[1]], result.vertices[t[2]]))
      ++result.dropped;
    else
      result.triangles.push_back(t);
  }
  refuse_too_many(file, result.triangles.size());
}

}  // namespace

Triangles load_triangles(const std::filesystem::path& file) {
  check_announced(file);
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(file.string(), aiProcess_Triangulate | aiProcess_ValidateDataStructure);
  if (scene == nullptr) fail(file, fmt::format("it cannot be read as a mesh: {}", importer.GetErrorString()));
  Triangles result;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) append(file, *scene->mMeshes[i], result);
  if (result.triangles.empty()) {
    fail(file, result.dropped == 0
                   ? std::string("it has no faces, so it has no surface")
                   : fmt::format("all its {} triangles are degenerate: they have no area", result.dropped));
  }
  return result;
}

}  // namespace tofgraph::simulation
