// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Rule for all filters: an invalid pixel has the flag 1 and is NaN in every length channel.
#include <tofgraph/harness.hpp>

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/cameras.hpp"

namespace tofgraph {
namespace {

constexpr std::size_t size = 204, pixels = size * size, bad = 70 * size + 33;

std::vector<float> image(float value, float at_bad) {
  std::vector<float> values(pixels, value);
  values[bad] = at_bad;
  return values;
}

/// Compares every output length channel with the flags. @returns number of invalid pixels
std::size_t expect_rule(const Harness& stage) {
  const auto flags = stage.get<std::uint16_t>("flags");
  std::size_t invalid = 0;
  for (const std::uint16_t bits : flags) invalid += bits & 1U;
  for (const char* name : {"distance", "range", "depth", "sigma", "points", "own_length"}) {
    if (!stage.has(name)) continue;
    const auto values = stage.get<float>(name);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::size_t pixel = i / (values.size() / flags.size());
      EXPECT_EQ(std::isnan(values[i]), (flags[pixel] & 1) != 0) << name << " at " << pixel;
      if (testing::Test::HasFailure()) return invalid;
    }
  }
  return invalid;
}

/// A stage, its input channel, and a value that it cannot accept, m.
struct Case {
  const char *stage, *length;
  float good, bad;
};

class InvalidPixels : public testing::TestWithParam<Case> {};

TEST_P(InvalidPixels, AreNanInEveryLengthAndFlagged) {
  const Case& c = GetParam();
  Harness stage(c.stage);
  stage.camera(test::profile_of(test::camcube2().view));
  stage.put<float>(c.length, {size, size}, image(c.good, c.bad));
  stage.put<float>("sigma", {size, size}, std::vector<float>(pixels, 0.01F), {.of = c.length});
  stage.put<float>("own_length", {size, size}, std::vector<float>(pixels, 2.0F), {.unit = "m"});
  stage.put<float>("true_depth", {size, size}, std::vector<float>(pixels, 1.0F));
  stage.run();
  EXPECT_EQ(expect_rule(stage), 1U);
  EXPECT_EQ(stage.get<std::uint16_t>("flags")[bad] & 1, 1);
  EXPECT_EQ(stage.get<float>("true_depth")[bad], 1) << "the truth of a simulation stays";
}

INSTANTIATE_TEST_SUITE_P(Stages, InvalidPixels,
                         testing::Values(Case{"optimized_bistatic", "distance", 1.0F, 0.001F},
                                         Case{"optimized_bistatic solver=bisection", "distance", 1.0F, 0.001F},
                                         Case{"perpendicular_illumination", "distance", 1.0F, 0.001F},
                                         Case{"simple_bistatic", "distance", 1.0F, 0.001F},
                                         Case{"simple_bistatic plane_depth='1 m'", "distance", 1.0F, 0.001F},
                                         Case{"point_cloud", "depth", 1.0F, 0.001F},
                                         Case{"point_cloud", "range", 1.0F, -1.0F},
                                         Case{"crop minimum='500 mm'", "depth", 1.0F, 0.2F}),
                         [](const auto& info) { return "Case" + std::to_string(info.index); });

TEST(InvalidPixels, OutsideTheLensModel) {
  test::Camera camera = test::camcube2();
  camera.view.distortion[0] = -3;  // folds over at r = 1/3
  Harness stage("point_cloud");
  stage.camera(test::profile_of(camera.view));
  stage.put<float>("depth", {size, size}, std::vector<float>(pixels, 1.0F));
  stage.put<float>("range", {size, size}, std::vector<float>(pixels, 1.0F));
  stage.run();
  EXPECT_GT(expect_rule(stage), 1000U);
  EXPECT_EQ(stage.get<std::uint16_t>("flags")[0], 64 | 1);
}

TEST(InvalidPixels, WithoutLightTheDecoderHasNoDistance) {
  Harness stage("four_phase_decoder");
  stage.camera(test::profile_of(test::camcube2().view));
  std::vector<float> phases;
  for (const float c : {100.0F, 50.0F, -100.0F, -50.0F}) {
    const auto one = image(c, 0.0F);
    phases.insert(phases.end(), one.begin(), one.end());
  }
  stage.put<float>("phases", {4, size, size}, phases);
  stage.put<float>("depth", {size, size}, std::vector<float>(pixels, 1.0F));
  stage.metadata().modulation_frequency = 20e6;
  stage.run();
  EXPECT_EQ(expect_rule(stage), 1U);
}

TEST(InvalidPixels, RemovedOutliers) {
  Harness stage("statistical_outlier_removal neighbours=8");
  std::vector<float> points;
  for (std::size_t i = 0; i < 900; ++i) {
    points.insert(points.end(), {0.01F * static_cast<float>(i % 30), 0.01F * static_cast<float>(i / 30), 1.0F});
  }
  points[3 * 435 + 2] = 3;
  stage.put<float>("points", {30, 30, 3}, points);
  stage.put<float>("depth", {30, 30}, std::vector<float>(900, 1.0F));
  stage.run();
  EXPECT_GE(expect_rule(stage), 1U);
  EXPECT_EQ(stage.get<std::uint16_t>("flags")[435], 128 | 1);
}

TEST(InvalidPixels, OfAnAverage) {
  Harness stage("average frames=2");
  for (int frame = 0; frame < 2; ++frame) {
    stage.put<float>("depth", {size, size}, image(1.0F, std::nanf("")));
    stage.put<float>("range", {size, size}, std::vector<float>(pixels, 1.0F));
    stage.put<float>("points", {size, size, 3}, std::vector<float>(3 * pixels, 1.0F));
    stage.run();
  }
  EXPECT_EQ(expect_rule(stage), 1U);
}

}  // namespace
}  // namespace tofgraph
