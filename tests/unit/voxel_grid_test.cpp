// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Compared with a map from voxel to points, in double.
#include <tofgraph/harness.hpp>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <random>

namespace tofgraph {
namespace {

constexpr std::size_t rows = 40, columns = 50, pixels = rows * columns;

struct Cloud {
  std::vector<float> points, amplitude, sigma;
  std::vector<std::uint16_t> flags;
};

Cloud cloud() {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(-1, 1);
  Cloud c;
  for (std::size_t i = 0; i < pixels; ++i) {
    const bool invalid = i % 20 == 0;
    for (int k = 0; k < 3; ++k) c.points.push_back(invalid ? NAN : place(random));
    c.amplitude.push_back(100.0F + static_cast<float>(i));
    c.sigma.push_back(invalid ? NAN : 0.001F * static_cast<float>(i % 7 + 1));
    c.flags.push_back(static_cast<std::uint16_t>(invalid ? 1 : 1U << (i % 5 + 1)));
  }
  return c;
}

void put(Harness& stage, const Cloud& c) {
  stage.put<float>("points", {rows, columns, 3}, c.points);
  stage.put<float>("amplitude", {rows, columns}, c.amplitude);
  stage.put<float>("sigma", {rows, columns}, c.sigma, {.unit = "m", .of = "points", .applied = "", .from = ""});
  stage.put<std::uint16_t>("flags", {rows, columns}, c.flags);
  stage.put<float>("phases", {4, rows, columns}, std::vector<float>(4 * pixels));
}

struct Sum {
  std::array<double, 3> point{};
  double amplitude = 0, variance = 0;
  std::uint16_t flags = 0;
  int count = 0;
};

TEST(VoxelGrid, IsTheMeanOfWhatIsInEachVoxel) {
  const double size = 0.25;
  const Cloud c = cloud();
  Harness stage("voxel_grid size='250 mm'");
  put(stage, c);
  stage.run();
  std::map<std::array<int, 3>, Sum> voxels;
  for (std::size_t i = 0; i < pixels; ++i) {
    if (std::isnan(c.points[3 * i])) continue;
    std::array<int, 3> key{};
    for (std::size_t k = 0; k < 3; ++k)
      key[2 - k] = static_cast<int>(std::floor(c.points[3 * i + k] / size));  // z y x: the order of PCL
    Sum& sum = voxels[key];
    for (std::size_t k = 0; k < 3; ++k) sum.point[k] += c.points[3 * i + k];
    sum.amplitude += c.amplitude[i];
    sum.variance += static_cast<double>(c.sigma[i]) * c.sigma[i];
    sum.flags |= c.flags[i];
    ++sum.count;
  }
  const auto points = stage.get<float>("points"), amplitude = stage.get<float>("amplitude"),
             sigma = stage.get<float>("sigma");
  const auto flags = stage.get<std::uint16_t>("flags");
  ASSERT_EQ(stage.extent("points"), (std::vector<std::uint64_t>{1, voxels.size(), 3}));
  ASSERT_EQ(stage.extent("flags"), (std::vector<std::uint64_t>{1, voxels.size()}));
  EXPECT_FALSE(stage.has("phases"));
  std::size_t i = 0;
  for (const auto& [key, sum] : voxels) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(points[3 * i + k], sum.point[k] / sum.count, 2e-6);
    EXPECT_NEAR(amplitude[i], sum.amplitude / sum.count, 1e-3);
    EXPECT_NEAR(sigma[i], std::sqrt(sum.variance) / sum.count, 1e-9);
    EXPECT_EQ(flags[i], sum.flags);
    ++i;
  }
}

TEST(VoxelGrid, LeavesThinVoxelsOutAndTakesEmptyClouds) {
  const Cloud c = cloud();
  Harness stage("voxel_grid size='250 mm' least=5");
  put(stage, c);
  stage.run();
  EXPECT_GT(stage.extent("points")[1], 0U);
  EXPECT_LT(stage.extent("points")[1], 512U);
  Harness empty("voxel_grid");
  empty.put<float>("points", {1, 2, 3}, std::vector<float>(6, NAN));
  empty.run();
  EXPECT_EQ(empty.extent("points"), (std::vector<std::uint64_t>{1, 0, 3}));
}

TEST(VoxelGrid, TakesVoxelsOfAnySizeInACloudOfAnyExtent) {
  const Cloud c = cloud();
  Harness small("voxel_grid size='1 um'");
  put(small, c);
  small.run();
  EXPECT_EQ(small.extent("points")[1], pixels - pixels / 20) << "each point has a voxel of its own";
  std::vector<float> far = {0, 0, 1, 0.001F, 0, 1, -9e5F, 9e5F, 9e5F};
  Harness wide("voxel_grid size='5 mm'");
  wide.put<float>("points", {1, 3, 3}, far);
  wide.run();
  EXPECT_EQ(wide.extent("points")[1], 2U);
  EXPECT_THROW(Harness("voxel_grid size='0 mm'"), std::runtime_error);
}

}  // namespace
}  // namespace tofgraph
