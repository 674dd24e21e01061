// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Every shape, compared with an independently derived analytic intersection, to 1 um.
#include "simulation/scene.hpp"
#include "tests/program.hpp"
#include "tests/unit/scene_worlds.hpp"

#include <array>
#include <limits>
#include <optional>
#include <thread>

namespace test {
namespace {

using simulation::Hit;
constexpr double micrometre = 1e-6;
constexpr double nothing = std::numeric_limits<double>::infinity();
const Vector3 lens{0, 0, focal_length};

/// Intersection of a ray from the lens with the parallelogram corner + a u + b v, 0 <= a, b <= 1: Cramer's rule.
double parallelogram(Vector3 ray, Vector3 corner, Vector3 u, Vector3 v) {
  const auto determinant = [](Vector3 a, Vector3 b, Vector3 c) {
    return a.x * (b.y * c.z - b.z * c.y) - b.x * (a.y * c.z - a.z * c.y) + c.x * (a.y * b.z - a.z * b.y);
  };
  // t ray - a u - b v = corner - lens
  const Vector3 right = corner - lens, minus_u = -1 * u, minus_v = -1 * v;
  const double d = determinant(ray, minus_u, minus_v);
  const double t = determinant(right, minus_u, minus_v) / d, a = determinant(ray, right, minus_v) / d,
               b = determinant(ray, minus_u, right) / d;
  return t > 0 && a >= 0 && a <= 1 && b >= 0 && b <= 1 ? t : nothing;
}

void expect_point_on_ray(const Hit& hit, Vector3 ray) {
  EXPECT_LT(norm(hit.point - (lens + hit.return_path * ray)), 1e-12);
  EXPECT_NEAR(norm(hit.normal), 1, 1e-12);
  EXPECT_LE(dot(hit.normal, ray), 0);
}

TEST(Board, TiltedFillsTheView) {
  const auto world = world_of("objects: [{type: board, distance: 800 mm, tilt_x: 12 deg, tilt_y: -25 deg}]");
  const auto all = rays(2000);
  const auto hits = traced(world, all);
  const Vector3 centre{0, 0, 0.8};
  const Vector3 u = turned_xyz({1, 0, 0}, 12, -25, 0), v = turned_xyz({0, 1, 0}, 12, -25, 0);
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_NEAR(hits[i].return_path, parallelogram(all[i], centre - 5 * u - 5 * v, 10 * u, 10 * v), micrometre);
    expect_point_on_ray(hits[i], all[i]);
    EXPECT_DOUBLE_EQ(hits[i].reflectivity, 0.85);
  }
}

TEST(Board, EndsWhereItsSizeSays) {
  const auto world = world_of("objects: [{type: board, distance: 1 m, size: [300 mm, 200 mm], reflectivity: 0.3}]");
  const double way = 1 - focal_length;
  const auto at = [&](double x, double y) {
    const Vector3 v{x, y, way};
    return traced(world, {(1 / norm(v)) * v})[0].return_path;
  };
  EXPECT_NEAR(at(0.15 - micrometre, 0.1 - micrometre), norm(Vector3{0.15, 0.1, way}), 2 * micrometre);
  EXPECT_EQ(at(0.15 + micrometre, 0), nothing);
  EXPECT_EQ(at(0, -0.1 - micrometre), nothing);
}

TEST(Box, AgreesWithItsSixFaces) {
  const std::array<double, 3> size = {0.15, 0.1, 0.25};
  const auto world = world_of(
      "objects: [{type: box, position: [20 mm, -10 mm, 600 mm], size: [150 mm, 100 mm, 250 mm], "
      "rotation: [20 deg, 35 deg, -15 deg], "
      "faces: {left: 0.1, right: 0.2, top: 0.3, bottom: 0.4, front: 0.5, back: 0.6}}]");
  const auto all = rays(20000);
  const auto hits = traced(world, all);
  const Vector3 centre{0.02, -0.01, 0.6};
  std::array<Vector3, 3> axes;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector3 axis{k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0};
    axes[k] = turned_xyz(axis, 20, 35, -15);
  }
  std::size_t met = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    double nearest = nothing, reflectivity = 0;
    Vector3 outwards;
    for (std::size_t face = 0; face < 6; ++face) {
      const std::size_t k = face / 2, l = (k + 1) % 3, m = (k + 2) % 3;
      const Vector3 out = (face % 2 == 0 ? -1 : 1) * axes[k];
      const Vector3 middle = centre + size[k] / 2 * out;
      const double t = parallelogram(all[i], middle - size[l] / 2 * axes[l] - size[m] / 2 * axes[m], size[l] * axes[l],
                                     size[m] * axes[m]);
      if (t >= nearest) continue;
      nearest = t;
      reflectivity = 0.1 * static_cast<double>(face + 1);
      outwards = out;
    }
    if (nearest == nothing) {
      EXPECT_EQ(hits[i].return_path, nothing);
      continue;
    }
    ++met;
    EXPECT_NEAR(hits[i].return_path, nearest, micrometre);
    EXPECT_NEAR(hits[i].reflectivity, reflectivity, 1e-12);
    EXPECT_LT(norm(hits[i].normal - outwards), 1e-12);
    expect_point_on_ray(hits[i], all[i]);
  }
  EXPECT_GT(met, 1000U);
}

TEST(Sphere, AgreesWithTheQuadraticEquation) {
  const auto world = world_of("objects: [{type: sphere, position: [50 mm, -30 mm, 2 m], radius: 400 mm}]");
  const auto all = rays(5000);
  const auto hits = traced(world, all);
  const Vector3 centre{0.05, -0.03, 2};
  std::size_t met = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    // |lens + t ray - centre|^2 = r^2 in long double
    const Vector3 from = lens - centre;
    const long double b = 2.0L * dot(all[i], from), c = static_cast<long double>(dot(from, from)) - 0.4L * 0.4L;
    const long double root = b * b - 4 * c;
    if (root < 0) {
      EXPECT_EQ(hits[i].return_path, nothing);
      continue;
    }
    ++met;
    EXPECT_NEAR(hits[i].return_path, static_cast<double>((-b - std::sqrt(root)) / 2), micrometre);
    EXPECT_NEAR(norm(hits[i].point - centre), 0.4, 1e-12);
    EXPECT_LT(norm(hits[i].normal - (1 / 0.4) * (hits[i].point - centre)), 1e-12);
  }
  EXPECT_GT(met, 500U);
}

TEST(Corner, ThreePlanesMeetInItsPoint) {
  const auto world = world_of(
      "objects: [{type: corner, planes: 3, position: [0 mm, 100 mm, 1 m], size: 400 mm, rotation: [0 deg, 10 deg, 0 "
      "deg], "
      "faces: {left: 0.2, right: 0.4, floor: 0.6}}]");
  const auto all = rays(5000);
  const auto hits = traced(world, all);
  const Vector3 apex{0, 0.1, 1}, up{0, -0.4, 0};
  const Vector3 left = 0.4 * turned({-std::sqrt(0.5), 0, -std::sqrt(0.5)}, 1, 10);
  const Vector3 right = 0.4 * turned({std::sqrt(0.5), 0, -std::sqrt(0.5)}, 1, 10);
  const std::array<std::pair<Vector3, Vector3>, 3> spans = {{{left, up}, {right, up}, {left, right}}};
  std::array<std::size_t, 3> met{};
  for (std::size_t i = 0; i < all.size(); ++i) {
    double nearest = nothing;
    std::size_t which = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double t = parallelogram(all[i], apex, spans[k].first, spans[k].second);
      if (t < nearest) {
        nearest = t;
        which = k;
      }
    }
    if (nearest == nothing) {
      EXPECT_EQ(hits[i].return_path, nothing);
      continue;
    }
    ++met[which];
    EXPECT_NEAR(hits[i].return_path, nearest, micrometre);
    EXPECT_NEAR(hits[i].reflectivity, 0.2 * static_cast<double>(which + 1), 1e-12);
  }
  for (const std::size_t count : met) EXPECT_GT(count, 100U);
}

TEST(Chessboard, InnerCornersAreWhereTheSquaresMeet) {
  const auto world = world_of(
      "objects: [{type: chessboard, columns: 4, rows: 3, square: 30 mm, distance: 700 mm, center: [40 mm, -20 mm], "
      "tilt_x: 15 deg, tilt_y: 20 deg, reflectivity: 0.9, dark: 0.1}]");
  const Vector3 centre{0.04, -0.02, 0.7};
  const auto brightness = [&](double a, double b) {  // on the board, m from its centre
    const Vector3 v = centre + turned_xyz({a, b, 0}, 15, 20, 0) - lens;
    const Hit hit = traced(world, {(1 / norm(v)) * v})[0];
    EXPECT_NEAR(hit.return_path, norm(v), micrometre);
    return hit.reflectivity;
  };
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      const double a = (column - 1.5) * 0.03, b = (row - 1) * 0.03, d = 2 * micrometre;
      const double upper_left = (column + row) % 2 == 0 ? 0.1 : 0.9;
      EXPECT_DOUBLE_EQ(brightness(a - d, b - d), upper_left);
      EXPECT_DOUBLE_EQ(brightness(a + d, b + d), upper_left);
      EXPECT_DOUBLE_EQ(brightness(a + d, b - d), 1 - upper_left);
      EXPECT_DOUBLE_EQ(brightness(a - d, b + d), 1 - upper_left);
    }
  }
  EXPECT_DOUBLE_EQ(brightness(-0.09, 0), 0.9) << "the margin is bright";
  EXPECT_DOUBLE_EQ(brightness(-0.06, -0.05), 0.1) << "the upper left square is dark";
}

TEST(Card, ShowsItsImage) {
  const tofgraph::tests::TemporaryFolder folder;
  tofgraph::tests::write_text(folder.path() / "four.pgm", "P2\n3 2\n255\n0 51 102\n153 204 255\n");
  for (const std::string way : {"nearest", "bilinear"}) {
    const auto scene = scene_of(
        "objects: [{type: card, distance: 1 m, size: [300 mm, 200 mm], image: four.pgm, reflectivity: 0.5, "
        "interpolation: " +
            way + "}]",
        folder.path());
    const auto world = simulation::make_world(scene, simulation::expand(scene).at(0));
    const auto brightness = [&](double x, double y) {
      const Vector3 v{x, y, 1 - focal_length};
      return traced(world, {(1 / norm(v)) * v})[0].reflectivity;
    };
    // The pixels' centres are 100 mm apart, their values 0.2 x 0.5.
    EXPECT_NEAR(brightness(-0.1, -0.05), 0.0, 1e-7);
    EXPECT_NEAR(brightness(0.1, 0.05), 0.5, 1e-7);
    EXPECT_NEAR(brightness(0, 0.05), 0.4, 1e-7);
    EXPECT_NEAR(brightness(-0.075, -0.05), way == "nearest" ? 0.0 : 0.025, 1e-7);
    EXPECT_NEAR(brightness(-0.025, 0.0 + 1e-9), way == "nearest" ? 0.4 : 0.075 + 0.15, 1e-7);
    EXPECT_NEAR(brightness(-0.149, -0.099), 0.0, 1e-7) << "the border is continued";
  }
}

TEST(World, TheNearestObjectIsSeen) {
  const auto world = world_of(
      "objects: [{type: board, distance: 2 m}, {type: sphere, position: [0 mm, 0 mm, 1 m], radius: 100 mm, surface: "
      "{roughness: 0.3 rad}}, {type: card, distance: 500 mm, center: [100 mm, 0 mm], size: [100 mm, 100 mm]}]");
  const Vector3 aside{0.1, 0, 0.5 - focal_length}, down{0, 0.3, 1};
  const auto hits = traced(world, {{0, 0, 1}, (1 / norm(aside)) * aside, (1 / norm(down)) * down});
  EXPECT_EQ(hits[0].object, 1U);
  EXPECT_EQ(hits[1].object, 2U);
  EXPECT_EQ(hits[2].object, 0U);
  ASSERT_NE(hits[0].surface, nullptr);
  EXPECT_DOUBLE_EQ(hits[0].surface->roughness, 0.3);
  EXPECT_EQ(hits[2].surface, nullptr) << "the scene says nothing of the board's";
}

TEST(World, ARayOutsideTheLensModelMeetsNothing) {
  const auto world = world_of(
      "objects: [{type: board, distance: 2 m}, {type: sphere, position: [0 mm, 0 mm, 1 m], radius: 100 mm}, "
      "{type: box, position: [0 mm, 0 mm, 1 m], size: [50 mm, 50 mm, 500 mm]}]");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(traced(world, {{nan, nan, nan}})[0].return_path, nothing);
}

TEST(World, GeometryEffectsMoveBoardsAndNothingElse) {
  const auto scene = scene_of(
      "objects: [{type: board, distance: 1 m, tilt_x: 5 deg}, {type: sphere, position: [0 mm, 0 mm, 600 mm], radius: "
      "50 "
      "mm}]");
  const auto condition = simulation::expand(scene).at(0);
  const simulation::BoardChange change{1.01, 0.02, 5 * M_PI / 180, 10 * M_PI / 180, -0.003};
  const auto world = simulation::make_world(scene, condition, change);
  const double distance = 1.01 * 1 + 0.02 - 0.003;
  const Vector3 normal = turned_xyz({0, 0, 1}, 10, 10, 0);
  const auto all = rays(100);
  for (const Hit& hit : traced(world, all)) {
    if (hit.object == 0) {
      EXPECT_NEAR(dot(normal, hit.point - Vector3{0, 0, distance}), 0, 1e-12);
    }
  }
  EXPECT_NEAR(traced(world, {{0, 0, 1}})[0].point.z, 0.55, 1e-12);
}

TEST(World, ThingsMoveWithTheirVelocity) {
  const auto scene = scene_of(
      "velocity: 200 mm/s\nobjects: [{type: board, distance: 1 m, velocity: [0 mm/s, 0 mm/s, 50 mm/s]}, "
      "{type: sphere, position: [0 mm, 0 mm, 600 mm], radius: 50 mm, velocity: [0 mm/s, 300 mm/s, 100 mm/s]}]");
  const auto world = simulation::make_world(scene, simulation::expand(scene).at(0), {.time = 0.5});
  EXPECT_NEAR(traced(world, {{0, 0, 1}})[0].point.z, 1.125, 1e-12);
  const Vector3 sphere = Vector3{0, 0.15, 0.65} - lens;
  EXPECT_NEAR(traced(world, {(1 / norm(sphere)) * sphere})[0].return_path, norm(sphere) - 0.05, 1e-12);
}

TEST(World, ARolledCameraSeesTheSceneTurnedBack) {
  const std::string objects =
      "objects: [{type: board, distance: 1 m, tilt_x: 10 deg, tilt_y: 20 deg}, {type: box, position: [50 mm, 20 mm, "
      "600 "
      "mm], size: [80 mm, 90 mm, 100 mm], rotation: [5 deg, 10 deg, 15 deg]}, {type: corner, position: [-80 mm, 0 mm, "
      "700 mm], size: 100 mm}, {type: sphere, position: [0 mm, -80 mm, 500 mm], radius: 30 mm}]";
  const auto upright = world_of(objects), rolled = world_of("roll: 30 deg\n" + objects);
  const auto all = rays(2000);
  std::vector<Vector3> turned_rays;
  for (const Vector3& ray : all) turned_rays.push_back(turned(ray, 2, 30));
  const auto seen = traced(rolled, all), expected = traced(upright, turned_rays);
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_NEAR(seen[i].return_path, expected[i].return_path, 1e-9);
    EXPECT_LT(norm(turned(seen[i].normal, 2, 30) - expected[i].normal), 1e-9);
    EXPECT_EQ(seen[i].object, expected[i].object);
  }
}

TEST(World, ACampaignsBoardNeedsNoScene) {
  simulation::SceneFile scene;
  scene.camera = scene_of("objects: [{type: board, distance: 1 m}]").camera;
  simulation::SceneCondition condition;
  EXPECT_THROW(simulation::make_world(scene, condition), std::runtime_error);
  condition.board_distance = 1.5;
  condition.reflectivity = 0.4;
  const Hit hit = traced(simulation::make_world(scene, condition), {{0, 0, 1}})[0];
  EXPECT_NEAR(hit.point.z, 1.5, 1e-15);
  EXPECT_DOUBLE_EQ(hit.reflectivity, 0.4);
  EXPECT_THROW(simulation::make_world(scene, condition, {.offset = -1.49}), std::runtime_error) << "behind the lens";
}

TEST(World, ThreadsTraceTheSame) {
  const auto world = world_of(
      "objects: [{type: board, distance: 1 m, tilt_y: 20 deg}, {type: box, position: [50 mm, 20 mm, 600 mm], size: [80 "
      "mm, 90 mm, 100 mm]}]");
  const auto all = rays(20000);
  std::vector<Hit> first, second;
  std::thread other([&] { second = traced(world, all); });
  first = traced(world, all);
  other.join();
  for (std::size_t i = 0; i < all.size(); ++i) EXPECT_EQ(first[i].return_path, second[i].return_path);
}

}  // namespace
}  // namespace test
