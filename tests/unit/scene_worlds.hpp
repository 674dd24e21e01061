// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Scenes from text, and rays for viewing them.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "simulation/scene.hpp"

namespace test {

using tofgraph::physics::Vector3;
namespace simulation = tofgraph::simulation;

inline constexpr double focal_length = 12.8e-3;  // m, of the camcube2

/// A scene of a CamCube; `rest` begins with "objects:". Fails the test on any error.
inline simulation::SceneFile scene_of(const std::string& rest, const std::filesystem::path& base = {}) {
  tofgraph::config::Diagnostics diagnostics;
  const auto document = tofgraph::config::parse_document("scene.yaml", "scene: 1\ncamera: camcube2\n" + rest, base);
  simulation::SceneFile scene = simulation::read_scene(document, diagnostics);
  if (diagnostics.ok()) simulation::load_assets(scene, diagnostics);
  EXPECT_TRUE(diagnostics.all().empty()) << diagnostics.text();
  return scene;
}

inline simulation::World world_of(const std::string& rest) {
  const simulation::SceneFile scene = scene_of(rest);
  return simulation::make_world(scene, simulation::expand(scene).at(0));
}

/// Random rays over a field of view of +-20 degrees, the same in every run.
inline std::vector<Vector3> rays(std::size_t count) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> tangent(-0.36, 0.36);
  std::vector<Vector3> result;
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3 v{tangent(random), tangent(random), 1};
    result.push_back((1 / norm(v)) * v);
  }
  return result;
}

inline std::vector<simulation::Hit> traced(const simulation::World& world, const std::vector<Vector3>& rays) {
  std::vector<simulation::Hit> hits(rays.size());
  world.trace(rays, hits);
  return hits;
}

/// Rotation about one axis, 0: x, 1: y, 2: z, textbook form; right-handed, degrees.
inline Vector3 turned(Vector3 v, int axis, double degrees) {
  const double c = std::cos(degrees * M_PI / 180), s = std::sin(degrees * M_PI / 180);
  if (axis == 0) return {v.x, c * v.y - s * v.z, s * v.y + c * v.z};
  if (axis == 1) return {c * v.x + s * v.z, v.y, -s * v.x + c * v.z};
  return {c * v.x - s * v.y, s * v.x + c * v.y, v.z};
}

inline Vector3 turned_xyz(Vector3 v, double x, double y, double z) {
  return turned(turned(turned(v, 0, x), 1, y), 2, z);
}

}  // namespace test
