// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Zero, negative, infinite or excessive lengths: every stage treats them exactly like NaN.
#include <tofgraph/harness.hpp>
// The header is written for plugins, which are compiled with a plugin name.
#define TOFGRAPH_PLUGIN_NAME "valid_lengths_test"
#define TOFGRAPH_PLUGIN_VERSION "1"
#include <tofgraph/lengths.hpp>

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "tests/unit/cameras.hpp"

namespace tofgraph {
namespace {

constexpr std::size_t rows = 12, columns = 16, pixels = rows * columns;
constexpr float infinity = std::numeric_limits<float>::infinity();

TEST(ValidLength, IsPositiveFiniteAndAtMostTheLimit) {
  for (const float good : {1e-6F, 0.3F, 7.5F, max_length}) EXPECT_TRUE(is_valid_length(good)) << good;
  for (const float bad : {0.0F, -0.0F, -1.0F, -1e30F, std::nextafter(max_length, infinity), 1e30F, infinity, NAN})
    EXPECT_FALSE(is_valid_length(bad)) << bad;
}

TEST(ValidPoint, IsFiniteInReachAndNotTheLensItself) {
  const PointRule optical(""), world("point_cloud transform T_world_camera");
  const float origin[] = {0, 0, 0}, near[] = {0.1F, -0.2F, 1}, far[] = {0, 0, 1e30F}, map[] = {5e5F, 5.4e6F, 120},
              unknown[] = {0, NAN, 1};
  EXPECT_TRUE(optical.is_valid(near));
  EXPECT_FALSE(optical.is_valid(origin));
  EXPECT_FALSE(optical.is_valid(map));
  EXPECT_TRUE(world.is_valid(map));
  EXPECT_TRUE(world.is_valid(origin));
  for (const float* point : {far, unknown}) {
    EXPECT_FALSE(optical.is_valid(point));
    EXPECT_FALSE(world.is_valid(point));
  }
}

TEST(ValidPoint, IsMovedByAPoseOrATransform) {
  for (const char* moved : {"T_world_camera", "point_cloud T_world_camera", "point_cloud transform voxel_grid"})
    EXPECT_TRUE(is_moved(moved)) << moved;
  for (const char* optical : {"", "point_cloud", "point_cloud orient normals"})
    EXPECT_FALSE(is_moved(optical)) << optical;
}

std::vector<float> scene(float at_some) {
  std::vector<float> image;
  for (std::size_t i = 0; i < pixels; ++i)
    image.push_back(i % 7 == 3 ? at_some : 1 + 0.004F * static_cast<float>((i * 37) % 11));
  return image;
}

struct Result {
  std::vector<float> lengths;
  std::vector<std::uint16_t> flags;
};

Result result_of(const std::string& line, const std::string& in, const std::string& out, float at_some) {
  Harness stage(line);
  test::Camera camera(columns, rows, 2e-3, 45e-6, {{"lamp", {0, 0, 0}, 1}});
  stage.camera(test::profile_of(camera.view));
  for (int frame = 0; frame < 3; ++frame) {
    stage.put<float>(in, {rows, columns}, scene(at_some));
    stage.run();
  }
  return {stage.get<float>(out), stage.get<std::uint16_t>("flags")};
}

struct Stage {
  const char *line, *in, *out;
};

class InvalidLength : public testing::TestWithParam<Stage> {};

TEST_P(InvalidLength, IsTreatedAsNan) {
  const auto& [line, in, out] = GetParam();
  const Result expected = result_of(line, in, out, NAN);
  for (const float bad : {0.0F, -0.5F, -1e30F, 2e6F, 1e30F, infinity, -infinity}) {
    const Result actual = result_of(line, in, out, bad);
    EXPECT_EQ(actual.flags, expected.flags) << bad;
    ASSERT_EQ(actual.lengths.size(), expected.lengths.size());
    for (std::size_t i = 0; i < actual.lengths.size(); ++i)
      ASSERT_EQ(std::bit_cast<std::uint32_t>(actual.lengths[i] == actual.lengths[i] ? actual.lengths[i] : -1.0F),
                std::bit_cast<std::uint32_t>(expected.lengths[i] == expected.lengths[i] ? expected.lengths[i] : -1.0F))
          << bad << " at " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Stages, InvalidLength,
    testing::Values(Stage{"average frames=3", "range", "range"},
                    Stage{"average frames=2 running=true", "distance", "distance"}, Stage{"median", "range", "range"},
                    Stage{"bilateral strength='20 mm' window=3", "range", "range"},
                    Stage{"yaroslavsky strength='20 mm' window=3", "depth", "depth"},
                    Stage{"non_local_means strength='20 mm' search=5", "range", "range"},
                    Stage{"temporal_kalman measurement_noise='5 mm'", "depth", "depth"},
                    Stage{"flying_pixels invalidate=true", "range", "range"}, Stage{"point_cloud", "range", "points"},
                    Stage{"point_cloud", "depth", "points"}, Stage{"optimized_bistatic", "distance", "depth"},
                    Stage{"optimized_bistatic solver=bisection", "distance", "depth"},
                    Stage{"perpendicular_illumination", "distance", "depth"},
                    Stage{"simple_bistatic", "distance", "depth"}),
    [](const auto& info) { return "Stage" + std::to_string(info.index); });

TEST(WildPoint, DisturbsNeitherOutlierRemovalNorVoxels) {
  for (const float wild : {1e30F, infinity, -3e38F}) {
    std::vector<float> points;
    for (std::size_t i = 0; i < pixels; ++i)
      for (const float at : {0.01F * static_cast<float>(i % columns), 0.01F * static_cast<float>(i / columns), 1.0F})
        points.push_back(at);
    points[3 * 20 + 2] = 1.5F;  // an outlier
    points[2] = wild;
    Harness removal("statistical_outlier_removal neighbours=5");
    removal.put<float>("points", {rows, columns, 3}, points);
    removal.run();
    EXPECT_NE(removal.get<std::uint16_t>("flags")[20] & flag::invalid, 0) << wild;
    EXPECT_EQ(removal.get<std::uint16_t>("flags")[40], 0) << wild;
    Harness voxels("voxel_grid size='1 mm'");
    voxels.put<float>("points", {rows, columns, 3}, points);
    voxels.run();
    EXPECT_EQ(voxels.extent("points"), (std::vector<std::uint64_t>{1, pixels - 1, 3})) << wild;
  }
}

}  // namespace
}  // namespace tofgraph
