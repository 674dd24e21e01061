// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Meshes, compared with the analytic sphere and with a test of every single triangle; invalid meshes.
#include "simulation/mesh_file.hpp"
#include "tests/program.hpp"
#include "tests/unit/scene_worlds.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <limits>

namespace test {
namespace {

using tofgraph::tests::TemporaryFolder;
using tofgraph::tests::write_text;
constexpr double nothing = std::numeric_limits<double>::infinity();
const Vector3 lens{0, 0, focal_length};

struct Triangulation {
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<unsigned, 3>> triangles;
};

/// A sphere about the origin, divided along meridians and parallels.
Triangulation sphere(double radius, unsigned meridians, unsigned parallels) {
  Triangulation mesh;
  const auto add = [&](double latitude, double longitude) {
    mesh.vertices.push_back({static_cast<float>(radius * std::cos(latitude) * std::cos(longitude)),
                             static_cast<float>(radius * std::cos(latitude) * std::sin(longitude)),
                             static_cast<float>(radius * std::sin(latitude))});
  };
  for (unsigned row = 1; row < parallels; ++row) {
    for (unsigned column = 0; column < meridians; ++column)
      add(M_PI * (row / double(parallels) - 0.5), 2 * M_PI * column / double(meridians));
  }
  const unsigned south = static_cast<unsigned>(mesh.vertices.size()), north = south + 1;
  mesh.vertices.push_back({0, 0, static_cast<float>(-radius)});
  mesh.vertices.push_back({0, 0, static_cast<float>(radius)});
  for (unsigned column = 0; column < meridians; ++column) {
    const unsigned next = (column + 1) % meridians, last = (parallels - 2) * meridians;
    mesh.triangles.push_back({south, next, column});
    mesh.triangles.push_back({north, last + column, last + next});
    for (unsigned row = 0; row + 2 < parallels; ++row) {
      const unsigned a = row * meridians + column, b = row * meridians + next;
      mesh.triangles.push_back({a, b, a + meridians});
      mesh.triangles.push_back({b, b + meridians, a + meridians});
    }
  }
  return mesh;
}

std::string ply(const Triangulation& mesh) {
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.vertices.size(), mesh.triangles.size());
  for (const auto& v : mesh.vertices) text += fmt::format("{:.9g} {:.9g} {:.9g}\n", v[0], v[1], v[2]);
  for (const auto& t : mesh.triangles) text += fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
  return text;
}

std::string obj(const Triangulation& mesh) {
  std::string text;
  for (const auto& v : mesh.vertices) text += fmt::format("v {:.9g} {:.9g} {:.9g}\n", v[0], v[1], v[2]);
  for (const auto& t : mesh.triangles) text += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return text;
}

Vector3 vertex(const Triangulation& mesh, unsigned index) {
  const auto& v = mesh.vertices[index];
  return {v[0], v[1], v[2]};
}

/// Circumradius of a triangle: a b c / (4 area).
double circumradius(Vector3 a, Vector3 b, Vector3 c) {
  const double x = norm(a - b), y = norm(b - c), z = norm(c - a), s = (x + y + z) / 2;
  return x * y * z / (4 * std::sqrt(s * (s - x) * (s - y) * (s - z)));
}

TEST(Mesh, ASphereOfTrianglesIsTheSphereWithinTheHeightOfItsFacets) {
  // A triangle with its corners on a sphere of radius r and a circumradius c has the distance sqrt(r^2 - c^2) from the
  // centre. Here that is less than 20 um inside.
  const double radius = 0.3;
  const Triangulation mesh = sphere(radius, 400, 200);
  double largest = 0;
  for (const auto& t : mesh.triangles)
    largest = std::max(largest, circumradius(vertex(mesh, t[0]), vertex(mesh, t[1]), vertex(mesh, t[2])));
  const double innermost = std::sqrt(radius * radius - largest * largest);
  ASSERT_LT(radius - innermost, 20e-6);

  const TemporaryFolder folder;
  write_text(folder.path() / "sphere.ply", ply(mesh));
  const std::string place = "position: [60 mm, -40 mm, 1500 mm]";
  const auto scene = scene_of("objects: [{type: mesh, file: sphere.ply, " + place + "}]", folder.path());
  const auto meshed = simulation::make_world(scene, simulation::expand(scene).at(0));
  const auto analytic = world_of("objects: [{type: sphere, radius: 300 mm, " + place + "}]");
  const auto all = rays(20000);
  const auto hits = traced(meshed, all), expected = traced(analytic, all);
  const Vector3 centre{0.06, -0.04, 1.5};
  std::size_t met = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (hits[i].return_path == nothing) continue;
    ++met;
    const double r = norm(hits[i].point - centre);
    EXPECT_GE(r, innermost - 1e-7);
    EXPECT_LE(r, radius + 1e-7);
    // Along an oblique ray the facet is farther away by its depth over the cosine of the angle of incidence.
    const double cosine = -dot(hits[i].normal, all[i]);
    if (cosine < 0.1 || expected[i].return_path == nothing) continue;
    EXPECT_NEAR(hits[i].return_path, expected[i].return_path, (radius - innermost + 1e-7) / (cosine - 0.02));
    EXPECT_LT(norm(hits[i].normal - expected[i].normal), 0.02);
  }
  EXPECT_GT(met, 1000U);
}

/// Moeller-Trumbore in double for every triangle. `sure`: the ray is not within 1e-5 of an edge of any.
double nearest_of_all(const Triangulation& mesh, Vector3 from, Vector3 direction, bool& sure) {
  const auto cross = [](Vector3 a, Vector3 b) {
    return Vector3{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  };
  double nearest = nothing;
  for (const auto& t : mesh.triangles) {
    const Vector3 a = vertex(mesh, t[0]), e = vertex(mesh, t[1]) - a, f = vertex(mesh, t[2]) - a;
    const Vector3 p = cross(direction, f);
    const double determinant = dot(e, p);
    const Vector3 s = from - a, q = cross(s, e);
    const double u = dot(s, p) / determinant, v = dot(direction, q) / determinant;
    const double edge = std::min({u, v, 1 - u - v});
    if (std::abs(edge) < 1e-5) sure = false;
    if (edge >= 0) nearest = std::min(nearest, dot(f, q) / determinant);
  }
  return nearest;
}

class PlacedMesh : public testing::TestWithParam<const char*> {};

TEST_P(PlacedMesh, StandsWhereItsPoseAndUnitSay) {
  const Triangulation mesh = sphere(120, 24, 12);  // in mm
  const TemporaryFolder folder;
  const std::string name = GetParam();
  write_text(folder.path() / name, name == "ball.ply" ? ply(mesh) : obj(mesh));
  const auto scene =
      scene_of("objects: [{type: mesh, file: " + name +
                   ", unit: 1 mm, position: [30 mm, 20 mm, 900 mm], rotation: [20 deg, 35 deg, -70 deg], "
                   "reflectivity: 0.6}]",
               folder.path());
  const auto world = simulation::make_world(scene, simulation::expand(scene).at(0));
  const auto all = rays(20000);
  const auto hits = traced(world, all);
  const auto to_mesh = [](Vector3 v) { return turned(turned(turned(v, 2, 70), 1, -35), 0, -20); };
  const Vector3 from = 1000 * to_mesh(lens - Vector3{0.03, 0.02, 0.9});
  std::size_t met = 0, compared = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    bool sure = true;
    const double expected = nearest_of_all(mesh, from, to_mesh(all[i]), sure) / 1000;
    if (!sure) continue;
    ++compared;
    if (expected == nothing) {
      EXPECT_EQ(hits[i].return_path, nothing);
      continue;
    }
    ++met;
    EXPECT_NEAR(hits[i].return_path, expected, 1e-6);
    EXPECT_DOUBLE_EQ(hits[i].reflectivity, 0.6);
  }
  EXPECT_GT(met, 1000U);
  EXPECT_GT(compared, all.size() * 9 / 10);
}

INSTANTIATE_TEST_SUITE_P(Formats, PlacedMesh, testing::Values("ball.ply", "ball.obj"),
                         [](const auto& info) { return std::string(info.param).substr(5); });

/// Message of load_triangles for a file with this content.
std::string refusal(const std::string& name, const std::string& content) {
  const TemporaryFolder folder;
  write_text(folder.path() / name, content);
  try {
    simulation::load_triangles(folder.path() / name);
  } catch (const std::runtime_error& error) {
    return std::string(error.what()).substr(folder.path().string().size() + 1);
  }
  return "nothing";
}

std::string ply_header(const std::string& vertices, const std::string& faces) {
  return "ply\nformat binary_little_endian 1.0\nelement vertex " + vertices +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " + faces +
         "\nproperty list uchar int vertex_indices\nend_header\n";
}

TEST(MeshFile, NonsenseIsRefusedWithItsReason) {
  EXPECT_EQ(refusal("a.ply", ply_header("3", "100000000")),
            "a.ply: it has 100000000 faces, but at most 10000000 are read: simplify the mesh");
  EXPECT_THAT(refusal("a.ply", ply_header("3", "-5")), testing::HasSubstr("no count in 'element face -5'"));
  EXPECT_EQ(refusal("a.ply", ply_header("5000000", "1")),
            "a.ply: it ends too early: its header announces at least 60000013 bytes of data, but there are only 0");
  EXPECT_THAT(refusal("a.ply", "no mesh at all\n"), testing::StartsWith("a.ply: it cannot be read as a mesh: "));
  EXPECT_THAT(refusal("a.ply", ""), testing::StartsWith("a.ply: it cannot be read as a mesh: "));
  EXPECT_THAT(refusal("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"), testing::StartsWith("a.obj: it "));
  EXPECT_EQ(refusal("a.obj", "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n"),
            "a.obj: all its 1 triangles are degenerate: they have no area");
  EXPECT_EQ(refusal("a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"),
            "a.obj: all its 1 triangles are degenerate: they have no area");
  EXPECT_THAT(refusal("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"), testing::StartsWith("a.obj: it "));
  EXPECT_THAT(refusal("a.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), testing::StartsWith("a.obj: it"));
}

TEST(MeshFile, AFileThatEndsTooEarlyIsRefused) {
  const std::string whole = ply(sphere(1, 12, 6));
  for (std::size_t lines = 1; lines < 100; lines += 7) {
    std::string text = whole;
    for (std::size_t i = 0; i < lines; ++i) text.erase(text.rfind('\n', text.size() - 2) + 1);
    EXPECT_THAT(refusal("a.ply", text), testing::StartsWith("a.ply: it ")) << lines << " lines are missing";
  }
  const std::string triangle(36, '\0');
  EXPECT_THAT(refusal("a.ply", ply_header("3", "1") + triangle), testing::StartsWith("a.ply: ")) << "no face follows";
}

TEST(MeshFile, DegenerateTrianglesAreLeftOutWithAWarning) {
  const TemporaryFolder folder;
  write_text(folder.path() / "a.obj", "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nv 0 -1 0\nf 1 2 3\nf 1 4 2\nf 1 1 2\n");
  tofgraph::config::Diagnostics diagnostics;
  const auto document = tofgraph::config::parse_document(
      "scene.yaml", "scene: 1\ncamera: camcube2\nobjects: [{type: mesh, file: a.obj, position: [0 m, 0 m, 2 m]}]\n",
      folder.path());
  auto scene = simulation::read_scene(document, diagnostics);
  simulation::load_assets(scene, diagnostics);
  ASSERT_TRUE(diagnostics.ok()) << diagnostics.text();
  ASSERT_EQ(diagnostics.all().size(), 1U);
  EXPECT_THAT(diagnostics.text(), testing::StartsWith("scene.yaml:3:30: warning: 2 degenerate triangles of "));
  const auto world = simulation::make_world(scene, simulation::expand(scene).at(0));
  EXPECT_NEAR(traced(world, {{0, 0, 1}})[0].point.z, 2, 1e-12);
}

TEST(MeshFile, ADamagedFileIsAMistakeAtItsPlace) {
  const TemporaryFolder folder;
  write_text(folder.path() / "a.ply", ply_header("3", "100000000"));
  tofgraph::config::Diagnostics diagnostics;
  const auto document = tofgraph::config::parse_document(
      "scene.yaml", "scene: 1\ncamera: camcube2\nobjects: [{type: mesh, file: a.ply, position: [0 m, 0 m, 2 m]}]\n",
      folder.path());
  auto scene = simulation::read_scene(document, diagnostics);
  ASSERT_TRUE(diagnostics.ok()) << diagnostics.text();
  simulation::load_assets(scene, diagnostics);
  EXPECT_THAT(diagnostics.text(), testing::StartsWith("scene.yaml:3:30: error: "));
}

TEST(MeshFile, BehindTheCameraIsAnError) {
  const TemporaryFolder folder;
  write_text(folder.path() / "a.obj", obj(sphere(0.1, 12, 6)));
  const auto scene = scene_of("objects: [{type: mesh, file: a.obj, position: [0 m, 0 m, -2 m]}]", folder.path());
  EXPECT_THROW(simulation::make_world(scene, simulation::expand(scene).at(0)), std::runtime_error);
}

}  // namespace
}  // namespace test
