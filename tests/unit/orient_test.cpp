// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Rotated and mirrored images, compared with OpenCV; the rotated camera, compared with the scene that it sees.
#include <gtest/gtest.h>
#include <tofgraph/harness.hpp>
#include <tofgraph/physics/lens.hpp>

#include "tests/unit/cameras.hpp"
#include "tests/unit/message_of.hpp"

#include <opencv2/core.hpp>

#include <cmath>
#include <optional>

using namespace tofgraph;

namespace {

struct Case {
  std::string settings;
  std::optional<int> flip;    ///< OpenCV flip code
  std::optional<int> rotate;  ///< OpenCV rotate code
};
const std::vector<Case> cases = {{"turn=90", {}, cv::ROTATE_90_CLOCKWISE},
                                 {"turn=180", {}, cv::ROTATE_180},
                                 {"turn=270", {}, cv::ROTATE_90_COUNTERCLOCKWISE},
                                 {"mirror=left_right", 1, {}},
                                 {"mirror=top_bottom", 0, {}},
                                 {"mirror=left_right turn=90", 1, cv::ROTATE_90_CLOCKWISE}};

/// A camera of 12 x 8 px without any symmetry.
struct Lopsided : test::Camera {
  Lopsided()
      : test::Camera(12, 8, 12.8e-3, 900e-6, {{"left", {-0.05, 0.01, 0}, 1}, {"right", {0.07, 0.02, 0.003}, 0.7}}) {
    const double distortion[5] = {-0.2, 0.03, 0.004, -0.006, 0}, further[7] = {0.05, 0, 0, 0.002, 0.001, -0.003, 5e-4};
    std::ranges::copy(distortion, view.distortion);
    std::ranges::copy(further, view.further_distortion);
    view.principal_point[0] = 5.1;
    view.principal_point[1] = 3.9;
    make_rays();
  }
};

cv::Mat oriented(const cv::Mat& image, const Case& one) {
  cv::Mat flipped = image.clone(), result;
  if (one.flip) cv::flip(image, flipped, *one.flip);
  if (!one.rotate) return flipped;
  cv::rotate(flipped, result, *one.rotate);
  return result;
}

TEST(Orient, ImagesAreThoseOfOpenCv) {
  const Lopsided camera;
  std::vector<float> depth(96);
  std::vector<std::uint16_t> phases(4 * 96);
  for (std::size_t i = 0; i < depth.size(); ++i) depth[i] = static_cast<float>(i + 1);
  for (std::size_t i = 0; i < phases.size(); ++i) phases[i] = static_cast<std::uint16_t>(i);
  for (const Case& one : cases) {
    Harness stage("orient " + one.settings);
    stage.camera(test::profile_of(camera.view));
    stage.put<float>("depth", {8, 12}, depth);
    stage.put<std::uint16_t>("taps_of_mine", {4, 8, 12}, phases, {.unit = "counts"});
    stage.run();
    const cv::Mat expected = oriented(cv::Mat(8, 12, CV_32F, depth.data()), one);
    ASSERT_EQ(stage.extent("depth"), (std::vector<std::uint64_t>{static_cast<std::uint64_t>(expected.rows),
                                                                 static_cast<std::uint64_t>(expected.cols)}));
    const auto seen = stage.get<float>("depth");
    const auto planes = stage.get<std::uint16_t>("taps_of_mine");
    const cv::Mat last = oriented(cv::Mat(8, 12, CV_16U, &phases[3 * 96]), one);
    for (int i = 0; i < 96; ++i) {
      EXPECT_EQ(seen[i], expected.at<float>(i / expected.cols, i % expected.cols)) << one.settings;
      EXPECT_EQ(planes[3 * 96 + i], last.at<std::uint16_t>(i / last.cols, i % last.cols)) << one.settings;
    }
  }
}

/// Rays and sources keep their positions in the scene, in the new axes. The rays computed from the rotated lens equal
/// the rotated rays.
TEST(Orient, TheCameraSeesTheSameScene) {
  const Lopsided camera;
  std::vector<float> index(96);
  for (std::size_t i = 0; i < index.size(); ++i) index[i] = static_cast<float>(i + 1);
  for (const Case& one : cases) {
    Harness stage("orient " + one.settings);
    stage.camera(test::profile_of(camera.view));
    stage.put<float>("depth", {8, 12}, index);
    stage.run();
    const tofgraph_camera& out = stage.camera_out();
    const auto pixels = stage.get<float>("depth");
    std::vector<float> rays(96 * 3);
    physics::pixel_rays(out, rays.data());
    const auto lights = lights_of(out);
    for (std::size_t i = 0; i < 96; ++i) {
      const float* before = &camera.rays[3 * (static_cast<std::size_t>(pixels[i]) - 1)];
      for (std::size_t k = 0; k < 3; ++k) ASSERT_NEAR(out.rays[3 * i + k], rays[3 * i + k], 2e-7) << one.settings;
      ASSERT_NEAR(out.rays[3 * i + 2], before[2], 1e-7);
      for (std::size_t s = 0; s < 2; ++s) {  // angles between ray and source are preserved
        const tofgraph_light& old = camera.lights[s];
        const double now = out.rays[3 * i] * lights[s].position[0] + out.rays[3 * i + 1] * lights[s].position[1];
        const double then = before[0] * old.position[0] + before[1] * old.position[1];
        ASSERT_NEAR(now, then, 1e-7) << one.settings;
      }
    }
  }
}

TEST(Orient, PointsFollowAndTheProfileMayBeKept) {
  const Lopsided camera;
  std::vector<float> points(3 * 96);
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = static_cast<float>(i);
  Harness stage("orient turn=90");
  stage.camera(test::profile_of(camera.view));
  stage.put<float>("points", {8, 12, 3}, points);
  stage.run();
  const auto turned = stage.get<float>("points");  // the pixel at row 7, column 0 moves to the top left
  EXPECT_EQ(turned[0], -points[3 * 84 + 1]);
  EXPECT_EQ(turned[1], points[3 * 84]);
  EXPECT_EQ(turned[2], points[3 * 84 + 2]);
  Harness surface("orient turn=90");
  surface.camera(test::profile_of(camera.view));
  surface.put<float>("points", {8, 12, 3}, points);
  surface.put<float>("normals", {8, 12, 3}, points);
  surface.run();
  EXPECT_EQ(surface.get<float>("normals"), turned) << "they turn like the points";
  Harness kept("orient turn=180 camera=kept");
  kept.camera(test::profile_of(camera.view));
  kept.put<float>("depth", {8, 12}, std::vector<float>(96, 1));
  kept.run();
  EXPECT_EQ(kept.camera_out().principal_point[0], 5.1);
}

TEST(Orient, PointsInTheWorldStayThere) {
  const Lopsided camera;
  std::vector<float> points(3 * 96);
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = static_cast<float>(i);
  Harness stage("orient turn=90");
  stage.camera(test::profile_of(camera.view));
  stage.put<float>("points", {8, 12, 3}, points, {.applied = "point_cloud transform T_world_camera"});
  stage.put<float>("normals", {8, 12, 3}, points, {.applied = "normals"});
  stage.run();
  for (const char* name : {"points", "normals"}) {
    const auto moved = stage.get<float>(name);  // the pixel at row 7, column 0 moves to the top left
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(moved[k], points[3 * 84 + k]) << name;
  }
}

TEST(Orient, RefusesWhatCannotBe) {
  Lopsided camera;
  const auto message = [&](const std::string& settings) {
    Harness stage("orient " + settings);
    stage.camera(test::profile_of(camera.view));
    stage.put<float>("depth", {8, 12}, std::vector<float>(96, 1));
    return message_of([&] { stage.prepare(); });
  };
  EXPECT_NE(message("").find("nothing is changed"), std::string::npos);
  EXPECT_NE(message("turn=90 camera=kept").find("exchanges width and height"), std::string::npos);
  camera.view.skew = 0.01;
  EXPECT_NE(message("turn=270").find("a lens with a skew"), std::string::npos);
  EXPECT_EQ(message("turn=180"), "no error");
}

}  // namespace
