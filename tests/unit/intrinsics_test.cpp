// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The replaced lens against OpenCV's inverse of it.
#include <gtest/gtest.h>
#include <tofgraph/harness.hpp>

#include "tests/unit/cameras.hpp"

#include <opencv2/calib3d.hpp>

#include <cmath>

using namespace tofgraph;

namespace {

constexpr std::size_t pixels = 204 * 204;

std::string message_of(auto&& call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no error";
}

TEST(Intrinsics, RaysAreThoseOfTheCalibratedLens) {
  Harness stage(
      "intrinsics fx=\"316.75 px\" fy=\"317 px\" cx=\"101.3 px\" cy=\"101.7 px\" k1=-0.44287 k2=0.21777 p1=0.00213 "
      "p2=-0.00497");
  stage.camera(test::profile_of(test::camcube2().view));
  stage.run();
  std::vector<cv::Point2d> seen, ideal;
  for (std::size_t i = 0; i < pixels; ++i) seen.emplace_back(i % 204, i / 204);
  const cv::Mat matrix = (cv::Mat_<double>(3, 3) << 316.75, 0, 101.3, 0, 317, 101.7, 0, 0, 1);
  const std::vector<double> distortion = {-0.44287, 0.21777, 0.00213, -0.00497, 0};
  cv::undistortPoints(seen, ideal, matrix, distortion, cv::noArray(), cv::noArray(),
                      cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 500, 1e-13));
  const auto rays = stage.get<float>("rays");
  for (std::size_t i = 0; i < pixels; ++i) {
    ASSERT_NEAR(rays[3 * i] / rays[3 * i + 2], ideal[i].x, 3e-7) << i;
    ASSERT_NEAR(rays[3 * i + 1] / rays[3 * i + 2], ideal[i].y, 3e-7) << i;
  }
  const tofgraph_camera& camera = stage.camera_out();
  EXPECT_NEAR(camera.focal_length, (316.75 + 317) / 2 * 40e-6, 1e-12) << "pixels of 40 um";
  EXPECT_EQ(camera.principal_point[1], 101.7);
  EXPECT_EQ(camera.light_count, 2U) << "the rest stays";
}

TEST(Intrinsics, WhatIsNotGivenStays) {
  Harness stage("intrinsics cx=\"100 px\"");
  stage.camera(test::profile_of(test::camcube2().view));
  stage.run();
  const tofgraph_camera& camera = stage.camera_out();
  EXPECT_EQ(camera.principal_point[0], 100);
  EXPECT_EQ(camera.principal_point[1], 101.5);
  EXPECT_DOUBLE_EQ(camera.focal_length, 12.8e-3);
  EXPECT_NEAR(stage.get<float>("rays")[3 * 100], 0, 1e-7) << "straight ahead in x";
}

TEST(Intrinsics, FocalLengthInMetresStaysUnknownWithoutPitch) {
  test::Camera camera = test::camcube2();
  camera.view.focal_length = camera.view.pitch[0] = camera.view.pitch[1] = std::nan("");
  Harness stage("intrinsics fx=\"300 px\" fy=\"300 px\"");
  stage.camera(test::profile_of(camera.view));
  stage.run();
  EXPECT_TRUE(std::isnan(stage.camera_out().focal_length));
}

TEST(Intrinsics, RefusesToComeTooLateOrToDoNothing) {
  const std::string profile = test::profile_of(test::camcube2().view);
  const std::vector<float> image(pixels, 1.0F);
  Harness late("intrinsics fx=\"300 px\"");
  late.camera(profile);
  late.put<float>("depth", {204, 204}, image, {.applied = "optimized_bistatic", .from = "distance rays"});
  EXPECT_NE(message_of([&] { late.prepare(); }).find("'depth' was already computed from it"), std::string::npos);
  Harness nothing("intrinsics");
  nothing.camera(profile);
  EXPECT_NE(message_of([&] { nothing.prepare(); }).find("nothing is replaced"), std::string::npos);
  Harness blind("intrinsics cx=\"9000 px\" k1=-50");
  blind.camera(profile);
  EXPECT_NE(message_of([&] { blind.prepare(); }).find("no pixel lies within"), std::string::npos);
  Harness edge("intrinsics k1=-3");
  edge.camera(profile);
  edge.prepare();
  ASSERT_EQ(edge.messages().size(), 1U);
  EXPECT_NE(edge.messages()[0].find("pixels lie outside the lens model"), std::string::npos);
}

}  // namespace
