// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Normals of surfaces with known normals in closed form, and their output to a PCD file.
#include "tests/program.hpp"

#include <tofgraph/harness.hpp>

#include <gtest/gtest.h>
#include <pcl/conversions.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <array>
#include <cmath>

namespace tofgraph {
namespace {

constexpr std::size_t rows = 40, columns = 50, pixels = rows * columns;
using Vector = std::array<double, 3>;

/// Points of z = z0 + a x + b y, 4 mm apart.
std::vector<float> plane(double a, double b) {
  std::vector<float> points;
  for (std::size_t i = 0; i < pixels; ++i) {
    const double x = 4e-3 * (static_cast<double>(i % columns) - 25), y = 4e-3 * (static_cast<double>(i / columns) - 20);
    for (const double v : {x, y, 1 + a * x + b * y}) points.push_back(static_cast<float>(v));
  }
  return points;
}

struct Result {
  std::vector<float> normals, curvature;
};

Result run(const std::string& line, const std::vector<float>& points) {
  Harness stage(line);
  stage.put<float>("points", {rows, columns, 3}, points);
  stage.run();
  return {stage.get<float>("normals"), stage.get<float>("curvature")};
}

TEST(Normals, OfPlanesPointToTheCamera) {
  for (const auto& [a, b] : {std::pair{0.0, 0.0}, {0.5, -0.2}, {-2.0, 1.0}}) {
    const double length = std::sqrt(a * a + b * b + 1);
    const Vector expected = {a / length, b / length, -1 / length};  // towards smaller z, where the camera is
    for (const std::string line : {"normals", "normals radius='15 mm'", "normals neighbours=8"}) {
      const Result result = run(line, plane(a, b));
      for (std::size_t i = 0; i < pixels; ++i) {
        for (std::size_t k = 0; k < 3; ++k)
          ASSERT_NEAR(result.normals[3 * i + k], expected[k], 2e-3) << line << ", point " << i;
        ASSERT_LT(result.curvature[i], 1e-5F);
      }
    }
  }
}

TEST(Normals, OfASphereAreItsRadii) {
  // The half of a sphere of 100 mm facing the camera, centre at 1 m.
  std::vector<float> points;
  std::vector<Vector> expected;
  for (std::size_t i = 0; i < pixels; ++i) {
    const double x = 2.5e-3 * (static_cast<double>(i % columns) - 25),
                 y = 2.5e-3 * (static_cast<double>(i / columns) - 20);
    const double square = 0.01 - x * x - y * y;
    const bool seen = square > 0.25 * 0.01;
    for (const double v : {x, y, 1 - std::sqrt(std::max(square, 0.0))})
      points.push_back(seen ? static_cast<float>(v) : NAN);
    expected.push_back({x / 0.1, y / 0.1, -std::sqrt(std::max(square, 0.0)) / 0.1});
  }
  const Result result = run("normals neighbours=12", points);
  std::size_t inner = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    ASSERT_EQ(std::isnan(points[3 * i]), std::isnan(result.normals[3 * i]));
    if (std::hypot(expected[i][0], expected[i][1]) > 0.7) continue;  // at the rim neighbours lie on one side
    ++inner;
    for (std::size_t k = 0; k < 3; ++k) ASSERT_NEAR(result.normals[3 * i + k], expected[i][k], 0.02) << "point " << i;
    ASSERT_GT(result.curvature[i], 1e-5F) << "a sphere is curved";
  }
  EXPECT_GT(inner, 1000U);
}

TEST(Normals, AreNotKnownOfLonePoints) {
  std::vector<float> points(3 * pixels, NAN);
  for (std::size_t k = 0; k < 3; ++k) points[300 + k] = points[900 + k] = 1;
  const Result result = run("normals", points);
  EXPECT_TRUE(std::ranges::all_of(result.normals, [](float v) { return std::isnan(v); }));
  EXPECT_TRUE(std::ranges::all_of(result.curvature, [](float v) { return std::isnan(v); }));
}

TEST(Normals, TurnWithTheirPoints) {
  Harness stage("transform angles='[0 deg, 90 deg, 0 deg]' translation='[1 m, 2 m, 3 m]'");
  stage.put<float>("points", {rows, columns, 3}, plane(0, 0));
  std::vector<float> normals;
  for (std::size_t i = 0; i < pixels; ++i) normals.insert(normals.end(), {0, 0, -1});
  stage.put<float>("normals", {rows, columns, 3}, normals);
  stage.run();
  const auto turned = stage.get<float>("normals");
  EXPECT_NEAR(turned[0], -1, 1e-6);  // R_y(90 deg) (0, 0, -1)
  EXPECT_NEAR(turned[1], 0, 1e-6);
  EXPECT_NEAR(turned[2], 0, 1e-6);
}

TEST(Normals, AreFieldsOfAPcdFile) {
  const tests::TemporaryFolder folder;
  const tests::Outcome outcome = tests::shell(
      "\"$TOFGRAPH\" run \"simulator noise=none ! four_phase_decoder ! optimized_bistatic ! point_cloud ! normals ! "
      "pcd_writer normals=true path=c_{frame}.pcd\" --camera camcube2",
      folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  pcl::PCLPointCloud2 read;
  ASSERT_EQ(pcl::PCDReader().read((folder.path() / "c_0.pcd").string(), read), 0);
  pcl::PointCloud<pcl::PointNormal> cloud;
  pcl::fromPCLPointCloud2(read, cloud);
  ASSERT_EQ(cloud.size(), 204U * 204U);
  for (const pcl::PointNormal& p : cloud) ASSERT_NEAR(p.normal_z, -1, 1e-4);  // a perpendicular board
  const tests::Outcome missing = tests::shell(
      "\"$TOFGRAPH\" run \"simulator ! four_phase_decoder ! optimized_bistatic ! point_cloud ! "
      "pcd_writer normals=true path=c_{frame}.pcd\" --camera camcube2",
      folder.path());
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_NE(missing.err.find("add the stage normals before"), std::string::npos) << missing.err;
}

}  // namespace
}  // namespace tofgraph
