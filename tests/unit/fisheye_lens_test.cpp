// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: FisheyeLens.IsFoundWithoutANominalOneWithHonestIntervals
// Rooms: calibration
// The fitted fisheye: OpenCV's model, its derivatives, and a lens from corners compared with OpenCV's own calibration.
#include <gtest/gtest.h>

#include "calibration/bundle.hpp"
#include "tests/unit/lens_truth.hpp"

#include <opencv2/calib3d.hpp>

#include <cmath>
#include <vector>

using namespace tofgraph::calibration;

namespace {

LensParameters wide_lens() {
  LensParameters lens{};
  lens[lens::fx] = 71.3;
  lens[lens::fy] = 70.8;
  lens[lens::cx] = 101.3;
  lens[lens::cy] = 102.4;
  lens[lens::skew] = 0.002;
  lens[lens::k1] = -0.021;
  lens[lens::k2] = 0.008;
  lens[lens::k3] = -0.004;
  lens[lens::k4] = 0.0007;
  lens[lens::fisheye] = 1;
  return lens;
}

/// Points of the plane z = 1 from the axis to 85 deg, in eight directions.
std::vector<cv::Point2d> plane_points() {
  std::vector<cv::Point2d> points = {{0, 0}, {1e-7, 0}, {3e-5, -2e-5}};
  for (int degrees = 1; degrees <= 85; degrees += 4)
    for (int turn = 0; turn < 8; ++turn) {
      const double r = std::tan(degrees * M_PI / 180), angle = turn * M_PI / 4 + 0.1;
      points.emplace_back(r * std::cos(angle), r * std::sin(angle));
    }
  return points;
}

TEST(FisheyeLens, ImagesPointsAsOpenCvDoes) {
  const LensParameters p = wide_lens();
  const cv::Matx33d matrix(p[lens::fx], 0, p[lens::cx], 0, p[lens::fy], p[lens::cy], 0, 0, 1);
  std::vector<cv::Point2d> expected;
  cv::fisheye::distortPoints(plane_points(), expected, matrix,
                             cv::Vec4d(p[lens::k1], p[lens::k2], p[lens::k3], p[lens::k4]), p[lens::skew]);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const cv::Point2d at = plane_points()[i];
    double pixel[2], back[2];
    project_plane<double>(p.data(), at.x, at.y, pixel);
    // OpenCV applies its skew to the distorted x before the focal length, as this code does.
    EXPECT_NEAR(pixel[0], expected[i].x, 1e-9) << at;
    EXPECT_NEAR(pixel[1], expected[i].y, 1e-9) << at;
    ASSERT_TRUE(unproject(p, pixel[0], pixel[1], back)) << at;
    EXPECT_NEAR(back[0], at.x, 1e-9 * (1 + at.dot(at))) << at;
    EXPECT_NEAR(back[1], at.y, 1e-9 * (1 + at.dot(at))) << at;
  }
}

TEST(FisheyeLens, HasTheDerivativesOfDifferences) {
  const LensParameters p = wide_lens();
  for (const cv::Point2d at : plane_points()) {
    const auto image = [&](const LensParameters& lens, double x, double y) {
      double pixel[2];
      project_plane<double>(lens.data(), x, y, pixel);
      return cv::Point2d(pixel[0], pixel[1]);
    };
    const double step = 1e-5 * (1 + std::sqrt(at.dot(at)));
    const std::array<double, 4> plane = plane_jacobian(p, at.x, at.y);
    for (int axis = 0; axis < 2; ++axis) {
      const double dx = axis == 0 ? step : 0, dy = axis == 1 ? step : 0;
      const cv::Point2d slope = (image(p, at.x + dx, at.y + dy) - image(p, at.x - dx, at.y - dy)) / (2 * step);
      EXPECT_NEAR(plane[static_cast<std::size_t>(axis)], slope.x, 1e-6) << at;
      EXPECT_NEAR(plane[static_cast<std::size_t>(2 + axis)], slope.y, 1e-6) << at;
    }
    const std::array<LensParameters, 2> by_lens = lens_jacobian(p, at.x, at.y);
    for (std::size_t i = 0; i < lens::fisheye; ++i) {
      LensParameters above = p, below = p;
      above[i] += 1e-5;
      below[i] -= 1e-5;
      const cv::Point2d slope = (image(above, at.x, at.y) - image(below, at.x, at.y)) / 2e-5;
      EXPECT_NEAR(by_lens[0][i], slope.x, 1e-6) << at << lens::names[i];
      EXPECT_NEAR(by_lens[1][i], slope.y, 1e-6) << at << lens::names[i];
    }
  }
}

/// Views of a lens whose image ends 80 deg from the axis.
test::TrueScene wide_scene() {
  test::TrueScene scene;
  scene.lens.fisheye = true;
  scene.lens.fx = 71.3;
  scene.lens.fy = 70.8;
  scene.lens.k1 = 0.03;
  scene.board.square = 0.06;
  scene.poses = test::true_poses(scene.lens, scene.board, 20);
  return scene;
}

TEST(FisheyeLens, IsFoundWithoutANominalOneWithHonestIntervals) {
  const test::TrueScene scene = wide_scene();
  constexpr int seeds = 60;
  double inside = 0, chi = 0;
  for (unsigned seed = 0; seed < seeds; ++seed) {
    Observations seen = scene.observed(0.1, seed);
    seen.fisheye = true;
    const LensSolution solution = solve_lens(seen, {.warp = false});
    ASSERT_EQ(solution.left_out.size(), 0U);
    const std::pair<std::size_t, double> truth[] = {{lens::fx, 71.3},  {lens::fy, 70.8}, {lens::cx, 101.3},
                                                    {lens::cy, 102.4}, {lens::k1, 0.03}, {lens::k2, 0},
                                                    {lens::k3, 0},     {lens::k4, 0}};
    for (const auto& [parameter, value] : truth) {
      const double error = (solution.lens[parameter] - value) / solution.sd(parameter);
      inside += std::abs(error) < 1.96 ? 1.0 / (8 * seeds) : 0;
      chi += error * error / (8 * seeds);
    }
    EXPECT_EQ(solution.lens[lens::p1], 0);
    EXPECT_EQ(solution.lens[lens::fisheye], 1);
  }
  EXPECT_GE(inside, 0.92);
  EXPECT_LE(inside, 0.98);
  EXPECT_NEAR(chi, 1, 0.2);
}

TEST(FisheyeLens, IsThatOfOpenCvsCalibration) {
  const test::TrueScene scene = wide_scene();
  Observations seen = scene.observed(0.05, 5);
  seen.fisheye = true;
  const LensSolution solution = solve_lens(seen, {.warp = false});
  std::vector<std::vector<cv::Point3d>> board;
  std::vector<std::vector<cv::Point2d>> image;
  for (const View& view : seen.views) {
    board.emplace_back();
    image.emplace_back();
    for (const Corner& corner : view.corners) {
      board.back().emplace_back(seen.points[corner.point].x, seen.points[corner.point].y, 0);
      image.back().emplace_back(corner.u, corner.v);
    }
  }
  cv::Matx33d matrix(70, 0, 101.5, 0, 70, 101.5, 0, 0, 1);
  cv::Vec4d powers(0, 0, 0, 0);
  std::vector<cv::Mat> turns, places;
  cv::fisheye::calibrate(
      board, image, cv::Size(204, 204), matrix, powers, turns, places,
      cv::fisheye::CALIB_USE_INTRINSIC_GUESS | cv::fisheye::CALIB_RECOMPUTE_EXTRINSIC | cv::fisheye::CALIB_FIX_SKEW,
      cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 200, 1e-12));
  // The same least squares problem, so they differ by a small fraction of the noise.
  EXPECT_NEAR(solution.lens[lens::fx], matrix(0, 0), 0.05 * solution.sd(lens::fx));
  EXPECT_NEAR(solution.lens[lens::fy], matrix(1, 1), 0.05 * solution.sd(lens::fy));
  EXPECT_NEAR(solution.lens[lens::cx], matrix(0, 2), 0.05 * solution.sd(lens::cx));
  EXPECT_NEAR(solution.lens[lens::cy], matrix(1, 2), 0.05 * solution.sd(lens::cy));
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(solution.lens[lens::fisheye_powers[i]], powers[static_cast<int>(i)],
                0.05 * solution.sd(lens::fisheye_powers[i]));
}

}  // namespace
