// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Every shipped camera profile, compared with the published numbers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "io/profile.hpp"

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;
const fs::path folder = fs::path(TOFGRAPH_SOURCE_DIR) / "devices" / "profiles";

io::CameraPtr load(const std::string& name) { return io::load_profile(folder / (name + ".yaml")); }

/// Width and height in px, frames/s, field of view in degrees, as published by the manufacturers; NaN: unpublished.
struct Published {
  std::uint32_t width, height;
  double frame_rate, view_x, view_y;
};
const double unknown = std::nan("");
const std::map<std::string, Published> published = {
    {"camcube2", {204, 204, 80, unknown, unknown}},  // the published 40 deg contradicts its 12.8 mm and 40 um
    {"camcube2_calibrated", {204, 204, 80, unknown, unknown}},
    {"camcube2_measured", {204, 204, 80, unknown, unknown}},
    {"camcube3", {204, 204, unknown, unknown, unknown}},
    {"sr4000", {176, 144, 50, 43, 34}},
    {"o3", {64, 48, 25, 40, 30}},
    {"s3", {64, 48, 20, 40, 30}},
    {"o3d303", {176, 132, unknown, unknown, unknown}},
    {"kinect2", {512, 424, 30, unknown, unknown}},
    {"monstar", {352, 287, unknown, unknown, unknown}},
    {"mlx75027_three_step", {640, 480, unknown, unknown, unknown}},
};

double view_in_degrees(std::uint32_t pixels, double focal_length) {
  return 2 * std::atan(pixels / 2.0 / focal_length) * 180 / std::numbers::pi;
}

TEST(Profiles, EveryOneThatIsShippedLoadsWithItsPublishedNumbers) {
  std::vector<std::string> found;
  for (const auto& file : fs::directory_iterator(folder)) {
    if (file.path().extension() != ".yaml") continue;
    const std::string name = file.path().stem();
    SCOPED_TRACE(name);
    found.push_back(name);
    ASSERT_TRUE(published.contains(name)) << "write its published numbers into this test";
    const Published& known = published.at(name);
    const io::CameraPtr loaded = load(name);
    const tofgraph_camera& camera = loaded->view();
    EXPECT_EQ(camera.name, name) << "the profile is found by its file's name";
    EXPECT_EQ(camera.width, known.width);
    EXPECT_EQ(camera.height, known.height);
    if (!std::isnan(known.frame_rate)) {
      EXPECT_EQ(camera.frame_rate, known.frame_rate);
    }
    if (!std::isnan(known.view_x)) {
      EXPECT_NEAR(view_in_degrees(camera.width, camera.focal_px[0]), known.view_x, 0.01);
      EXPECT_NEAR(view_in_degrees(camera.height, camera.focal_px[1]), known.view_y, 0.01);
    }
    // The whole image lies within the lens model, and the centre looks along the axis.
    const std::size_t pixels = std::size_t{camera.width} * camera.height;
    EXPECT_TRUE(std::all_of(camera.rays, camera.rays + 3 * pixels, [](float v) { return std::isfinite(v); }));
    EXPECT_GT(camera.rays[3 * (camera.height / 2 * camera.width + camera.width / 2) + 2], 0.99F);
  }
  EXPECT_EQ(found.size(), published.size()) << "a profile is gone";
}

TEST(Profiles, CamCube2IsThatOfTheReference) {
  const io::CameraPtr nominal = load("camcube2"), calibrated = load("camcube2_calibrated");
  const tofgraph_camera& camera = nominal->view();
  EXPECT_DOUBLE_EQ(camera.focal_length, 12.8e-3);
  EXPECT_NEAR(camera.focal_px[0], 320, 1e-9) << "12.8 mm / 40 um";
  EXPECT_NEAR(camera.focal_px[1], 320, 1e-9);
  EXPECT_EQ(camera.principal_point[0], 101.5) << "(102.5, 102.5), counted from 1";
  EXPECT_EQ(camera.principal_point[1], 101.5);
  EXPECT_EQ(camera.modulation_frequency, 20e6);
  EXPECT_DOUBLE_EQ(camera.integration_time[0], 0.5e-3);
  EXPECT_DOUBLE_EQ(camera.integration_time[1], 50e-3);
  ASSERT_EQ(camera.light_count, 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_DOUBLE_EQ(camera.lights[i].position[0], i == 0 ? -0.05 : 0.05);
    EXPECT_EQ(camera.lights[i].position[1], 0);
    EXPECT_EQ(camera.lights[i].position[2], 0);
  }
  EXPECT_STREQ(camera.lights[0].name, "left");
  const tofgraph_camera& measured = calibrated->view();
  EXPECT_DOUBLE_EQ(measured.focal_length, 12.67e-3);
  EXPECT_EQ(measured.principal_point[0], 101.3) << "(102.3, 102.7), counted from 1";
  EXPECT_EQ(measured.principal_point[1], 101.7);
  const double distortion[5] = {-0.44287, 0.21777, 0.00213, -0.00497, 0};
  for (int i = 0; i < 5; ++i) EXPECT_EQ(measured.distortion[i], distortion[i]) << i;
  EXPECT_EQ(calibrated->measured, (std::vector<std::string>{"focal_length", "principal_point", "distortion"}));
}

TEST(Profiles, CamCube3HasThePublishedLens) {
  const io::CameraPtr loaded = load("camcube3");
  const tofgraph_camera& camera = loaded->view();
  EXPECT_EQ(camera.focal_px[0], 273.139);
  EXPECT_EQ(camera.focal_px[1], 273.486);
  EXPECT_EQ(camera.principal_point[0], 107.868);
  EXPECT_EQ(camera.principal_point[1], 98.381);
  const double distortion[5] = {-0.48669, 0.55394, 0.0022202, -0.0030085, 0};
  for (int i = 0; i < 5; ++i) EXPECT_EQ(camera.distortion[i], distortion[i]) << i;
  EXPECT_TRUE(std::isnan(camera.focal_length)) << "its pitch is not known";
}

}  // namespace
}  // namespace tofgraph::tests
