// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: MeshBytes.NonsenseIs*:MeshBytes.PlyIs*
// Rooms: simulation
// Meshes in every encoding of their formats, and concave faces by their areas.
#include <gmock/gmock.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "simulation/mesh_file.hpp"
#include "tests/program.hpp"
#include "tests/unit/message_of.hpp"

namespace tofgraph::simulation {
namespace {

using Points = std::vector<std::array<float, 3>>;
using Faces = std::vector<std::vector<int>>;

double area_of(const Triangles& mesh) {
  double area = 0;
  for (const auto& t : mesh.triangles) {
    const auto &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const double u[] = {double{b[0]} - a[0], double{b[1]} - a[1], double{b[2]} - a[2]},
                 v[] = {double{c[0]} - a[0], double{c[1]} - a[1], double{c[2]} - a[2]};
    area += std::sqrt(std::pow(u[1] * v[2] - u[2] * v[1], 2) + std::pow(u[2] * v[0] - u[0] * v[2], 2) +
                      std::pow(u[0] * v[1] - u[1] * v[0], 2)) /
            2;
  }
  return area;
}

class MeshBytes : public testing::Test {
 protected:
  Triangles load(const std::string& name, const std::string& content) const {
    tests::write_text(folder_.path() / name, content);
    return load_triangles(folder_.path() / name);
  }
  std::string refusal(const std::string& name, const std::string& content) const {
    return message_of([&] { load(name, content); });
  }

  tests::TemporaryFolder folder_;
};

template <class T> std::string number(T value, bool big) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof value);
  if (big) std::reverse(raw, raw + sizeof raw);
  return {raw, sizeof raw};
}

std::string header(const std::string& format, const Points& points, const Faces& faces, const std::string& end = "\n") {
  std::string text;
  for (const std::string& line :
       {std::string("ply"), "format " + format + " 1.0", std::string("comment element face 99"),
        fmt::format("element vertex {}", points.size()), std::string("property float x"),
        std::string("property float y"), std::string("property float z"), std::string("property uchar red"),
        fmt::format("element face {}", faces.size()), std::string("property list uchar int vertex_indices"),
        std::string("property float quality"), std::string("end_header")})
    text += line + end;
  return text;
}

std::string binary_ply(const Points& points, const Faces& faces, bool big, const std::string& end = "\n") {
  std::string text = header(big ? "binary_big_endian" : "binary_little_endian", points, faces, end);
  for (const auto& p : points) {
    for (const float at : p) text += number(at, big);
    text += '\x07';
  }
  for (const auto& face : faces) {
    text += static_cast<char>(face.size());
    for (const int corner : face) text += number(corner, big);
    text += number(0.5F, big);
  }
  return text;
}

std::string ascii_ply(const Points& points, const Faces& faces) {
  std::string text = header("ascii", points, faces);
  for (const auto& p : points) text += fmt::format("{} {} {} 7\n", p[0], p[1], p[2]);
  for (const auto& face : faces) text += fmt::format("{} {} 0.5\n", face.size(), fmt::join(face, " "));
  return text;
}

std::string obj(const Points& points, const Faces& faces) {
  std::string text = "# a comment\r\n";
  for (const auto& p : points) text += fmt::format("v {} {} {}\r\n", p[0], p[1], p[2]);
  for (const auto& face : faces) {
    text += "f";
    for (const int corner : face) text += fmt::format(" {}/1/{}", corner + 1, corner + 1);
    text += "\r\n";
  }
  return text;
}

/// A coordinate whose first byte in a little-endian file is the given one.
float beginning_with(unsigned char byte) {
  float value = 0.75F;
  std::memcpy(&value, &byte, 1);
  return value;
}

TEST_F(MeshBytes, PlyIsReadByItsBytesWhateverTheFirstOneIs) {
  for (const bool big : {false, true}) {
    for (int byte = 0; byte < 256; ++byte) {
      Points points = {{0.75F, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
      if (!big) points[0][0] = beginning_with(static_cast<unsigned char>(byte));
      const Triangles mesh = load("a.ply", binary_ply(points, {{0, 1, 2, 3}}, big));
      ASSERT_EQ(mesh.vertices, points) << byte;
      ASSERT_EQ(mesh.triangles.size(), 2U);
    }
  }
  // Big endian: the first byte is the exponent.
  for (const float first : {1.2e-33F, -3.4e-12F, 0.0F}) {
    const Points points = {{first, 0, 1}, {1, 0, 1}, {1, 1, 1}};
    EXPECT_EQ(load("a.ply", binary_ply(points, {{0, 1, 2}}, true)).vertices, points);
  }
}

TEST_F(MeshBytes, LineEndsAndEndingsInCapitalsDoNotMatter) {
  const Points points = {{beginning_with('\n'), 0, 1}, {1, 0, 1}, {1, 1, 1}};
  for (const std::string end : {"\n", "\r\n", "\r"})
    EXPECT_EQ(load("A.PLY", binary_ply(points, {{0, 1, 2}}, false, end)).vertices, points);
  EXPECT_EQ(load("A.Ply", ascii_ply({{0, 0, 1}, {1, 0, 1}, {1, 1, 1}}, {{0, 1, 2}})).triangles.size(), 1U);
  EXPECT_EQ(load("A.OBJ", obj({{0, 0, 1}, {1, 0, 1}, {1, 1, 1}}, {{0, 1, 2}})).triangles.size(), 1U);
}

TEST_F(MeshBytes, ScenesTakeEndingsInCapitals) {
  tests::write_text(folder_.path() / "PART.PLY", ascii_ply({{-1, -1, 1}, {1, -1, 1}, {0, 1, 1}}, {{0, 1, 2}}));
  tests::write_text(folder_.path() / "s.yaml",
                    "scene: 1\ncamera: camcube2\nnoise: none\noutput: distance\nobjects:\n"
                    "  - {type: mesh, file: PART.PLY, position: [0 m, 0 m, 0 m]}\n");
  const tests::Outcome outcome = tests::shell("\"$TOFGRAPH\" simulate s.yaml -o a.h5", folder_.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
}

struct Polygon {
  const char* name;
  Points points;
  Faces faces;
  double area;
};

class Concave : public MeshBytes, public testing::WithParamInterface<Polygon> {};

TEST_P(Concave, FacesCoverTheirOwnAreaOnly) {
  const Polygon& p = GetParam();
  Points turned = p.points;
  for (auto& point : turned) point = {point[2], point[0] * 0.8F - point[1] * 0.6F, point[0] * 0.6F + point[1] * 0.8F};
  Faces backwards = p.faces;
  for (auto& face : backwards) std::ranges::reverse(face);
  for (const Points& points : {p.points, turned}) {
    for (const Faces& faces : {p.faces, backwards}) {
      EXPECT_NEAR(area_of(load("a.obj", obj(points, faces))), p.area, 1e-5 * p.area);
      EXPECT_NEAR(area_of(load("a.ply", binary_ply(points, faces, true))), p.area, 1e-5 * p.area);
      EXPECT_NEAR(area_of(load("b.ply", ascii_ply(points, faces))), p.area, 1e-5 * p.area);
    }
  }
}

Points star(int tips) {
  Points points;
  for (int i = 0; i < 2 * tips; ++i) {
    const double r = i % 2 == 0 ? 1 : 0.3, a = M_PI * i / tips;
    points.push_back({static_cast<float>(r * std::cos(a)), static_cast<float>(r * std::sin(a)), 2});
  }
  return points;
}
std::vector<int> in_order(int count) {
  std::vector<int> face;
  for (int i = 0; i < count; ++i) face.push_back(i);
  return face;
}

INSTANTIATE_TEST_SUITE_P(
    Faces, Concave,
    testing::Values(Polygon{"l", {{0, 0, 1}, {3, 0, 1}, {3, 1, 1}, {1, 1, 1}, {1, 2, 1}, {0, 2, 1}}, {in_order(6)}, 4},
                    Polygon{"arrow", {{0, 0, 1}, {2, 1, 1}, {0, 2, 1}, {0.5F, 1, 1}}, {in_order(4)}, 1.5},
                    Polygon{"u_with_corners_on_lines",
                            {{0, 0, 1},
                             {1, 0, 1},
                             {3, 0, 1},
                             {3, 3, 1},
                             {2, 3, 1},
                             {2, 1, 1},
                             {1, 1, 1},
                             {1, 3, 1},
                             {0, 3, 1},
                             {0, 1, 1}},
                            {in_order(10)},
                            7},
                    Polygon{"star", star(7), {in_order(14)}, 7 * 0.3 * std::sin(M_PI / 7)},
                    // A square with a square hole, connected by a double edge.
                    Polygon{"hole",
                            {{0, 0, 1}, {4, 0, 1}, {4, 4, 1}, {0, 4, 1}, {1, 1, 1}, {1, 3, 1}, {3, 3, 1}, {3, 1, 1}},
                            {{0, 1, 2, 3, 0, 4, 5, 6, 7, 4}},
                            12},
                    Polygon{"two_holes",
                            {{0, 0, 1},
                             {7, 0, 1},
                             {7, 3, 1},
                             {0, 3, 1},
                             {1, 1, 1},
                             {1, 2, 1},
                             {2, 2, 1},
                             {2, 1, 1},
                             {5, 1, 1},
                             {5, 2, 1},
                             {6, 2, 1},
                             {6, 1, 1}},
                            {{0, 1, 11, 8, 9, 10, 11, 1, 2, 3, 0, 4, 5, 6, 7, 4}},
                            19}),
    [](const auto& info) { return std::string(info.param.name); });

TEST_F(MeshBytes, ObjCountsFromTheEndAndContinuesLines) {
  const Triangles mesh = load("a.obj", "v 0 0 1 0.5 0.5 0.5\nv +1 0 1\nv 1 1 1\nf -3 -2 \\\n -1\no part\nl 1 2\np 1\n");
  EXPECT_EQ(mesh.triangles.size(), 1U);
  EXPECT_EQ(mesh.vertices[1], (std::array<float, 3>{1, 0, 1}));
}

TEST_F(MeshBytes, StripsOfPlyAreTriangles) {
  const std::string text =
      "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
      "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
      "0 0 1\n1 0 1\n0 1 1\n1 1 1\n2 2 1\n8 0 1 2 3 -1 1 3 4\n";
  const Triangles mesh = load("a.ply", text);
  EXPECT_EQ(mesh.triangles.size(), 3U);
  EXPECT_NEAR(area_of(mesh), 1.5, 1e-6);
}

TEST_F(MeshBytes, NonsenseIsRefusedWithoutAnAbort) {
  const Points points = {{0, 0, 1}, {1, 0, 1}, {1, 1, 1}};
  EXPECT_THAT(refusal("a.ply", binary_ply(points, {{0, 1, 7}}, false)),
              testing::HasSubstr("the corner 7, but there are 3"));
  EXPECT_THAT(refusal("a.ply", binary_ply(points, {{0, 1, -2}}, false)), testing::HasSubstr("the corner -2"));
  EXPECT_THAT(refusal("a.obj", obj(points, {{0, 1, 7}})), testing::HasSubstr("the corner 8, but there are 3"));
  EXPECT_THAT(refusal("a.obj", "v 0 0 1\nf -1 -2 -3\n"), testing::HasSubstr("line 2: a face has the corner '-2'"));
  EXPECT_THAT(refusal("a.obj", "v 0 zero 1\n"), testing::HasSubstr("line 1: 'zero' is not a coordinate"));
  EXPECT_THAT(refusal("a.obj", "v 0 0 1\nv 3 2 1\nv 3 0 1\nv 0 1 1\nf 1 2 3 4\n"),
              testing::HasSubstr("crosses itself"));
  const std::string whole = binary_ply(points, {{0, 1, 2}}, false);
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_NE(refusal("a.ply", whole.substr(0, length)), "no error") << length;
  std::string wrong = whole;
  wrong.replace(wrong.find("list uchar"), 10, "list float");
  EXPECT_THAT(refusal("a.ply", wrong), testing::HasSubstr("unknown type"));
}

}  // namespace
}  // namespace tofgraph::simulation
