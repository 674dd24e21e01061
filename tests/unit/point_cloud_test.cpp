// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Points, compared with pinhole geometry.
#include <gtest/gtest.h>
#include <tofgraph/channels.hpp>
#include <tofgraph/harness.hpp>

#include "tests/unit/cameras.hpp"
#include "tests/unit/message_of.hpp"
#include "tests/unit/processors.hpp"

#include <cmath>

using namespace tofgraph;

namespace {

constexpr double focal = 12.8e-3, pitch = 40e-6;
constexpr std::size_t width = 21, height = 13, pixels = width * height;  // no multiple of the vector length

test::Camera small_camera() { return {width, height, focal, pitch, {{"lamp", {0, 0, 0}, 1}}}; }

/// A perpendicular board in the optical frame: the pixel's point at this z.
struct Point {
  double x, y, z;
  Point(std::size_t i, double from_lens)
      : x((static_cast<double>(i % width) - 10) * pitch / focal * from_lens),
        y((static_cast<double>(i / width) - 6) * pitch / focal * from_lens),
        z(from_lens) {}
  double range() const { return std::sqrt(x * x + y * y + z * z); }
};

TEST(PointCloud, DepthCountsFromTheSensorPlane) {
  const std::string profile = test::profile_of(small_camera().view);
  std::vector<float> depth(pixels);
  for (std::size_t i = 0; i < pixels; ++i) depth[i] = 0.5F + 0.02F * static_cast<float>(i);
  test::on_each_processor([&](const std::string& processor) {
    Harness stage("point_cloud");
    stage.camera(profile);
    stage.put<float>("depth", {height, width}, depth);
    stage.run();
    ASSERT_EQ(stage.extent("points"), (std::vector<std::uint64_t>{height, width, 3}));
    const auto points = stage.get<float>("points");
    for (std::size_t i = 0; i < pixels; ++i) {
      const Point expected(i, depth[i] - focal);
      ASSERT_NEAR(points[3 * i], expected.x, 3e-7) << processor << ", pixel " << i;
      ASSERT_NEAR(points[3 * i + 1], expected.y, 3e-7) << processor << ", pixel " << i;
      ASSERT_NEAR(points[3 * i + 2], expected.z, 6e-7) << processor << ", pixel " << i;
      ASSERT_EQ(stage.get<std::uint16_t>("flags")[i], 0);
    }
  });
}

TEST(PointCloud, RangeCountsFromTheLens) {
  for (const std::string channel : {"range", "distance"}) {
    std::vector<float> range(pixels);
    for (std::size_t i = 0; i < pixels; ++i) range[i] = static_cast<float>(Point(i, 1.5).range());
    Harness stage(channel == "range" ? "point_cloud" : "point_cloud assume=range");
    stage.camera(test::profile_of(small_camera().view));
    stage.put<float>(channel, {height, width}, range);
    stage.run();
    const auto points = stage.get<float>("points");
    for (std::size_t i = 0; i < pixels; ++i) {
      EXPECT_NEAR(points[3 * i], Point(i, 1.5).x, 3e-7);
      EXPECT_NEAR(points[3 * i + 1], Point(i, 1.5).y, 3e-7);
      EXPECT_NEAR(points[3 * i + 2], 1.5, 3e-7);
    }
  }
}

TEST(PointCloud, RangeNeedsNoLengthsInTheProfile) {
  test::Camera camera = small_camera();
  camera.view.focal_length = camera.view.pitch[0] = camera.view.pitch[1] = std::nan("");
  const std::string profile = test::profile_of(camera.view);
  Harness range("point_cloud");
  range.camera(profile);
  range.put<float>("range", {height, width}, std::vector<float>(pixels, 2.0F));
  range.run();
  EXPECT_NEAR(range.get<float>("points")[3 * (6 * width + 10) + 2], 2, 1e-6);
  Harness depth("point_cloud");
  depth.camera(profile);
  depth.put<float>("depth", {height, width}, std::vector<float>(pixels, 2.0F));
  EXPECT_NE(message_of([&] { depth.prepare(); }).find("no focal length in metres"), std::string::npos);
}

TEST(PointCloud, InvalidPixelsAreNan) {
  const float nan = std::nanf(""), infinite = std::numeric_limits<float>::infinity();
  test::Camera camera = small_camera();
  camera.view.distortion[0] = -300;  // turns at r = 1/30, imaged at 1/45 = 7.1 px
  std::vector<float> depth(pixels, 1.0F);
  std::vector<std::uint16_t> flags(pixels);
  const std::size_t middle = 6 * width + 10;
  depth[middle] = nan;
  depth[middle + 1] = infinite;
  depth[middle + 2] = 0.01F;  // behind the lens
  depth[middle + 3] = -1;
  flags[middle - 1] = flag::invalid | flag::user;
  flags[middle - 2] = flag::saturated;
  Harness stage("point_cloud");
  stage.camera(test::profile_of(camera.view));
  stage.put<float>("depth", {height, width}, depth);
  stage.put<float>("sigma", {height, width}, std::vector<float>(pixels, 1e-3F), {.of = "depth"});
  stage.put<std::uint16_t>("flags", {height, width}, flags);
  stage.run();
  const auto points = stage.get<float>("points"), sigma = stage.get<float>("sigma");
  const auto out = stage.get<std::uint16_t>("flags");
  for (const std::size_t i : {middle, middle + 1, middle + 2, middle + 3, middle - 1, std::size_t{0}}) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_TRUE(std::isnan(points[3 * i + k])) << i;
    EXPECT_TRUE(std::isnan(sigma[i])) << i;
    EXPECT_EQ(out[i] & flag::invalid, flag::invalid) << i;
  }
  EXPECT_EQ(out[0], flag::invalid | flag::outside_lens);
  EXPECT_EQ(out[middle - 1], flag::invalid | flag::user);
  EXPECT_EQ(out[middle - 2], flag::saturated) << "saturated alone is not invalid";
  EXPECT_FALSE(std::isnan(points[3 * (middle - 2) + 2]));
}

TEST(PointCloud, SigmaIsAlongTheRay) {
  Harness stage("point_cloud");
  stage.camera(test::profile_of(small_camera().view));
  stage.put<float>("depth", {height, width}, std::vector<float>(pixels, 1.0F));
  stage.put<float>("sigma", {height, width}, std::vector<float>(pixels, 1e-3F), {.of = "depth"});
  stage.run();
  const Point corner(0, 1.0);
  EXPECT_NEAR(stage.get<float>("sigma")[0], 1e-3 * corner.range(), 1e-9);
  EXPECT_EQ(stage.of("sigma"), "points");
}

TEST(PointCloud, RefusesHalfPathsAndForeignSigma) {
  const std::string profile = test::profile_of(small_camera().view);
  const std::vector<float> image(pixels, 1.0F);
  Harness raw("point_cloud");
  raw.camera(profile);
  raw.put<float>("distance", {height, width}, image);
  const std::string text = message_of([&] { raw.prepare(); });
  EXPECT_NE(text.find("half of the travelled path"), std::string::npos) << text;
  EXPECT_NE(text.find("assume: range"), std::string::npos) << text;
  Harness sigma("point_cloud");
  sigma.camera(profile);
  sigma.put<float>("depth", {height, width}, image);
  sigma.put<float>("sigma", {height, width}, image, {.of = "distance"});
  EXPECT_NE(message_of([&] { sigma.prepare(); }).find("sigma is that of 'distance'"), std::string::npos);
  Harness chosen("point_cloud channel=range");
  chosen.camera(profile);
  chosen.put<float>("depth", {height, width}, image);
  chosen.put<float>("range", {height, width}, std::vector<float>(pixels, 3.0F));
  chosen.run();
  EXPECT_NEAR(chosen.get<float>("points")[3 * (6 * width + 10) + 2], 3, 1e-6);
}

}  // namespace
