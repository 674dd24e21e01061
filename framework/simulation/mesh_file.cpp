// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/mesh_file.hpp"

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>
#include <assimp/Importer.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <stdexcept>

namespace tofgraph::simulation {
namespace {

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& problem) {
  throw std::runtime_error(fmt::format("{}: {}", file.string(), problem));
}

void refuse_too_many(const std::filesystem::path& file, std::size_t faces) {
  if (faces > max_triangles)
    fail(file, fmt::format("it has {} faces, but at most {} are read: simplify the mesh", faces, max_triangles));
}

/// What a PLY header says of one kind of element.
struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::uint64_t min_bytes = 0;  ///< that one of them takes in a binary file; polygons have at least three corners
};

struct PlyHeader {
  bool ascii = false;
  std::vector<PlyElement> elements;
};

std::uint64_t bytes_of(const std::string& type) {
  static const std::map<std::string, std::uint64_t> sizes = {
      {"char", 1},  {"uchar", 1},   {"int8", 1},   {"uint8", 1},  {"short", 2}, {"ushort", 2},
      {"int16", 2}, {"uint16", 2},  {"int", 4},    {"uint", 4},   {"int32", 4}, {"uint32", 4},
      {"float", 4}, {"float32", 4}, {"double", 8}, {"float64", 8}};
  const auto found = sizes.find(type);
  return found != sizes.end() ? found->second : 1;
}

/// Reads up to the end of the header; what is not a header gives no elements.
PlyHeader read_ply_header(const std::filesystem::path& file, std::istream& in) {
  PlyHeader header;
  std::string line;
  for (int lines = 0; lines < 1000 && std::getline(in, line) && !line.starts_with("end_header"); ++lines) {
    std::istringstream stream(line);
    const std::vector<std::string> words{std::istream_iterator<std::string>(stream), {}};
    if (words.size() < 2) continue;
    if (words[0] == "format") header.ascii = words[1] == "ascii";
    if (words[0] == "element") {
      PlyElement element{words[1]};
      const std::string count = words.size() > 2 ? words[2] : "";
      const auto [end, failed] = std::from_chars(count.data(), count.data() + count.size(), element.count);
      if (failed != std::errc() || end != count.data() + count.size())
        fail(file, fmt::format("its header has no count in '{}'", line));
      header.elements.push_back(element);
    }
    if (words[0] != "property" || header.elements.empty()) continue;
    PlyElement& element = header.elements.back();
    const bool corners = element.name == "face" && words.back().starts_with("vertex_ind");
    element.min_bytes += words[1] != "list" ? bytes_of(words[1])
                         : words.size() < 5 ? 0
                                            : bytes_of(words[2]) + (corners ? 3 * bytes_of(words[3]) : 0);
  }
  return header;
}

std::uint64_t lines_left(std::istream& in) {
  std::uint64_t lines = 0;
  for (std::string line; std::getline(in, line);) lines += line.find_first_not_of(" \t\r") != std::string::npos ? 1 : 0;
  return lines;
}

std::uint64_t bytes_left(std::istream& in) {
  const auto here = in.tellg();
  in.seekg(0, std::ios::end);
  return here < 0 ? 0 : static_cast<std::uint64_t>(in.tellg() - here);
}

/// Compares what the header announces with what the file has, before a reader makes room for it: it would also take a
/// file that ends too early for a whole one.
void check_ply(const std::filesystem::path& file, std::istream& in) {
  const PlyHeader header = read_ply_header(file, in);
  double announced = 0;  // lines or bytes; in floating point, as no count is too large for it
  for (const PlyElement& element : header.elements) {
    if (element.name == "face") refuse_too_many(file, element.count);
    announced += static_cast<double>(element.count) * (header.ascii ? 1.0 : static_cast<double>(element.min_bytes));
  }
  const std::uint64_t there = header.ascii ? lines_left(in) : bytes_left(in);
  if (announced <= static_cast<double>(there)) return;
  const char* unit = header.ascii ? "lines" : "bytes";
  fail(file, fmt::format("it ends too early: its header announces at least {:.0f} {} of data, but there are only {}",
                         announced, unit, there));
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
    check_ply(file, in);
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
  const double max_length = std::max({square(u), square(v), square(w)});
  return !(std::sqrt(square(normal)) > 1e-6 * max_length);
}

void append(const std::filesystem::path& file, const aiMesh& mesh, Triangles& result) {
  const auto first = static_cast<std::uint32_t>(result.vertices.size());
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
    const aiVector3D& v = mesh.mVertices[i];
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
      fail(file, fmt::format("its vertex {} is not a finite point", i));
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
