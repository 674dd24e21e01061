// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The shared formulas, compared with published tables, closed forms and other libraries.
#include "tests/unit/cameras.hpp"
#include "tests/unit/thesis_table.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>
#include <opencv2/calib3d.hpp>
#include <tofgraph/physics/four_phase.hpp>
#include <tofgraph/physics/geometry.hpp>
#include <tofgraph/physics/lens.hpp>
#include <tofgraph/physics/non_linearity.hpp>
#include <tofgraph/physics/phasor.hpp>
#include <tofgraph/physics/random.hpp>
#include <tofgraph/physics/unwrapping.hpp>

#include <numbers>
#include <random>

using namespace tofgraph::physics;

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

// The calibrated lens of the reference's camera.
constexpr double camcube_distortion[5] = {-0.44287, 0.21777, 0.00213, -0.00497, 0};

TEST(Lens, DistortsAsOpenCvProjects) {
  const double coefficients[5] = {-0.31, 0.12, 0.003, -0.002, 0.05};
  const Lens lens(coefficients);
  std::vector<cv::Point3d> points;
  for (double x = -0.6; x <= 0.6; x += 0.15) {
    for (double y = -0.6; y <= 0.6; y += 0.15) points.emplace_back(x, y, 1);
  }
  std::vector<cv::Point2d> projected;
  const std::vector<double> cv_coefficients(std::begin(coefficients), std::end(coefficients));
  cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), cv::Mat::eye(3, 3, CV_64F), cv_coefficients, projected);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const ImagePoint p = lens.distort({points[i].x, points[i].y});
    EXPECT_NEAR(p.x, projected[i].x, 1e-14);
    EXPECT_NEAR(p.y, projected[i].y, 1e-14);
  }
}

TEST(Lens, UndistortIsTheInverseOverTheWholeSensor) {
  const Lens lens(camcube_distortion);
  for (int v = 0; v < 204; v += 7) {
    for (int u = 0; u < 204; u += 7) {
      const ImagePoint seen{(u - 101.3) / 316.75, (v - 101.7) / 316.75};
      const auto p = lens.undistort(seen);
      ASSERT_TRUE(p);
      const ImagePoint again = lens.distort(*p);
      EXPECT_NEAR(again.x, seen.x, 1e-12);
      EXPECT_NEAR(again.y, seen.y, 1e-12);
      EXPECT_LT(std::hypot(p->x - seen.x, p->y - seen.y), 0.1) << "another branch of the polynomial";
    }
  }
}

/// A wide lens as specified by camera drivers: rational, with thin-prism terms.
void make_wide(test::Camera& camera) {
  const double distortion[5] = {0.5, -0.2, 1e-3, -2e-3, 0.01}, further[7] = {0.83, -0.1, 0.02, 3e-3, -1e-3, 2e-3, 5e-4};
  std::ranges::copy(distortion, camera.view.distortion);
  std::ranges::copy(further, camera.view.further_distortion);
  camera.view.focal_px[0] = 250;
  camera.view.focal_px[1] = 251;
}

TEST(Lens, RationalWithAThinPrismDistortsAsOpenCvProjects) {
  test::Camera camera = test::camcube2();
  make_wide(camera);
  const Lens lens(camera.view);
  std::vector<double> coefficients(std::begin(camera.view.distortion), std::end(camera.view.distortion));
  coefficients.insert(coefficients.end(), std::begin(camera.view.further_distortion),
                      std::end(camera.view.further_distortion));
  std::vector<cv::Point3d> points;
  for (double x = -0.6; x <= 0.6; x += 0.1) {
    for (double y = -0.6; y <= 0.6; y += 0.1) points.emplace_back(x, y, 1);
  }
  std::vector<cv::Point2d> projected;
  cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), cv::Mat::eye(3, 3, CV_64F), coefficients, projected);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const ImagePoint p = lens.distort({points[i].x, points[i].y});
    EXPECT_NEAR(p.x, projected[i].x, 1e-14);
    EXPECT_NEAR(p.y, projected[i].y, 1e-14);
    const auto back = lens.undistort(p);
    ASSERT_TRUE(back) << points[i];
    EXPECT_NEAR(back->x, points[i].x, 1e-11);
    EXPECT_NEAR(back->y, points[i].y, 1e-11);
  }
}

TEST(Lens, RationalEndsWhereItTurnsAndWhereItsDenominatorIsZero) {
  test::Camera camera = test::camcube2();
  camera.view.distortion[0] = -0.3;
  camera.view.further_distortion[0] = 1e-9;  // nearly the polynomial, which turns at r = 1/sqrt(0.9)
  const Lens barrel(camera.view);
  EXPECT_NEAR(barrel.undistort({2.0 / 3 / std::sqrt(0.9) - 1e-6, 0})->x, 1 / std::sqrt(0.9), 2e-3);
  EXPECT_FALSE(barrel.undistort({2.0 / 3 / std::sqrt(0.9) + 1e-6, 0}));
  camera.view.distortion[0] = 0;
  camera.view.further_distortion[0] = -0.25;  // r / (1 - r^2 / 4) is monotonic up to r = 2
  const Lens pole(camera.view);
  EXPECT_NEAR(pole.undistort({1.9 / (1 - 0.25 * 1.9 * 1.9), 0})->x, 1.9, 1e-9);
  EXPECT_FALSE(pole.invertible_at({2.001, 0}));
}

TEST(Rays, OfSkewAxesAreThoseOfTheirMatrix) {
  test::Camera camera = test::camcube2();
  make_wide(camera);
  camera.view.skew = 0.01;
  camera.make_rays();
  const cv::Mat matrix = (cv::Mat_<double>(3, 3) << 250, 250 * 0.01, 101.5, 0, 251, 101.5, 0, 0, 1);
  std::vector<double> coefficients(std::begin(camera.view.distortion), std::end(camera.view.distortion));
  coefficients.insert(coefficients.end(), std::begin(camera.view.further_distortion),
                      std::end(camera.view.further_distortion));
  for (std::size_t v = 0; v < 204; v += 29) {
    for (std::size_t u = 0; u < 204; u += 29) {
      const float* ray = camera.ray(v, u);
      ASSERT_GT(ray[2], 0);
      // projectPoints supports no skew: it gives the distorted point, the matrix gives the pixel.
      std::vector<cv::Point2d> distorted;
      cv::projectPoints(std::vector<cv::Point3d>{{ray[0] / ray[2], ray[1] / ray[2], 1}}, cv::Vec3d(), cv::Vec3d(),
                        cv::Mat::eye(3, 3, CV_64F), coefficients, distorted);
      const cv::Mat pixel = matrix * (cv::Mat_<double>(3, 1) << distorted[0].x, distorted[0].y, 1);
      EXPECT_NEAR(pixel.at<double>(0), static_cast<double>(u), 1e-4);
      EXPECT_NEAR(pixel.at<double>(1), static_cast<double>(v), 1e-4);
    }
  }
}

TEST(Lens, NothingBeyondTheTurningPoint) {
  const double barrel[5] = {-0.3, 0, 0, 0, 0};  // r (1 - 0.3 r^2) turns at r = 1/sqrt(0.9), where it is 2/3 of that
  const Lens lens(barrel);
  const double farthest = 2.0 / 3 / std::sqrt(0.9);
  EXPECT_NEAR(lens.undistort({0.7, 0})->x, 1.0, 1e-9);
  EXPECT_TRUE(lens.undistort({farthest - 1e-6, 0}));
  EXPECT_FALSE(lens.undistort({farthest + 1e-6, 0}));
  EXPECT_FALSE(lens.undistort({0, -3}));
  EXPECT_FALSE(lens.undistort({not_a_number, 0}));
  const double folding[5] = {-0.9, 0.3, 0, 0, -0.01};  // turns, increases again, turns again
  const Lens fold(folding);
  for (double r = 0.05; r < 3; r += 0.05) {
    const auto p = fold.undistort({r, 0});
    EXPECT_LT(p ? p->x : 0, 0.75) << "a solution beyond the first turning point";
  }
}

TEST(Rays, AreThoseOfThePinhole) {
  const test::Camera camera = test::camcube2();
  const float* corner = camera.ray(0, 203);
  const double x = 101.5 * 40e-6, length = std::sqrt(2 * x * x + 12.8e-3 * 12.8e-3);
  EXPECT_NEAR(corner[0], x / length, 1e-7);
  EXPECT_NEAR(corner[1], -x / length, 1e-7);
  EXPECT_NEAR(corner[2], 12.8e-3 / length, 1e-7);
}

TEST(Rays, NeedNoLengthsAndAreNanOutsideTheLens) {
  test::Camera camera = test::camcube2();
  camera.view.focal_length = camera.view.pitch[0] = camera.view.pitch[1] = not_a_number;
  camera.view.distortion[0] = -3;  // turns at r = 1/3, imaged at 2/9 = 71 px
  camera.make_rays();
  EXPECT_FALSE(std::isnan(camera.ray(101, 101 + 70)[2]));
  EXPECT_TRUE(std::isnan(camera.ray(101, 101 + 73)[2]));
}

TEST(ImagingModel, GivesThePublishedMeansAndDeviations) {
  const test::Camera camera = test::camcube2();
  const Geometry geometry = geometry_of(camera.view);
  const auto boards = test::modelled_boards();
  ASSERT_EQ(boards.size(), 15U);
  for (const auto& board : boards) {
    const auto modelled =
        test::over_window(board.half_width, board.half_height, [&](std::size_t row, std::size_t column) {
          return distance_at_depth(geometry, unit_ray(camera.ray(row, column)), board.depth);
        });
    EXPECT_NEAR(modelled.mean, board.mean, 0.01e-3) << board.depth << " m";
    EXPECT_NEAR(modelled.deviation, board.deviation, 0.01e-3) << board.depth << " m";
  }
}

TEST(ImagingModel, NeedsLengthsAndLight) {
  test::Camera camera = test::camcube2();
  camera.view.light_count = 0;
  EXPECT_THROW(geometry_of(camera.view), std::invalid_argument);
  camera.view.focal_length = not_a_number;
  EXPECT_THROW(geometry_of(camera.view), std::invalid_argument);
}

TEST(Board, TiltsAsTheMatrixSays) {
  const Geometry geometry{12.8e-3, {{{0, 0, 0}, 1}}};
  const double tilt_x = 0.3, tilt_y = -0.2, distance = 0.8;
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(tilt_y, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(tilt_x, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  const Eigen::Vector3d centre(0, 0, distance), normal = turn * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d direction = Eigen::Vector3d(0.2, -0.1, 1).normalized(), lens(0, 0, 12.8e-3);
  const double expected = normal.dot(centre - lens) / normal.dot(direction);
  const Plane plane = board(distance, tilt_x, tilt_y);
  EXPECT_NEAR(reflected_path(geometry, {direction.x(), direction.y(), direction.z()}, plane), expected, 1e-14);
  EXPECT_TRUE(std::isnan(reflected_path(geometry, {0, 0, 1}, board(-0.5))));
}

TEST(OptimizedBistatic, BisectionAgreesWithTheClosedFormOfOneSource) {
  const test::Camera camera = test::camcube2({{"one", {0.07, -0.02, 0.01}, 1}});
  const Geometry geometry = geometry_of(camera.view);
  for (std::size_t i = 0; i < 204; i += 29) {
    const Vector3 ray = unit_ray(camera.ray(i, 203 - i / 2));
    EXPECT_TRUE(std::isnan(optimized_bistatic_bisection(geometry, ray, 0.999 * min_distance(geometry, ray))));
    // |b + D_ref u| = K - D_ref with K = 2 D - D_sen and b = L - S.
    const Vector3 b = geometry.lens_centre() - geometry.sources.front().position;
    for (const double distance : {0.05, 0.3, 1.0, 7.4, 100.0}) {
      const double return_path = optimized_bistatic_bisection(geometry, ray, distance);
      const double k = 2 * distance - sensor_path(geometry, ray);
      EXPECT_NEAR((k * k - dot(b, b)) / (2 * (k + dot(ray, b))), return_path, 1e-12 * (1 + distance));
      EXPECT_NEAR(distance_at(geometry, ray, return_path), distance, 1e-12 * (1 + distance));
    }
  }
}

TEST(Phasor, TwoEqualSourcesInterfereAsPublished) {
  // |P| = 2 A cos(w (D1 - D2) / (2 c)) with A each source's amplitude, phase that of the mean path.
  const Geometry geometry{12.8e-3, {{{-0.9, 0, 0}, 0.5}, {{0.4, 0, 0}, 0.5}}};
  const Vector3 ray = (1 / std::sqrt(1.04)) * Vector3{0.2, 0, 1};
  const Exposure exposure{.gain = 7e6, .contrast = 0.5, .integration_time = 1e-3, .modulation_frequency = 20e6};
  const double return_path = 0.6;
  const Light light = reference_light(geometry, ray, return_path, 0.8, exposure);
  const Vector3 point{0.2 / std::sqrt(1.04) * 0.6, 0, 12.8e-3 + 0.6 / std::sqrt(1.04)};
  const double d1 = std::hypot(point.x + 0.9, point.z), d2 = std::hypot(point.x - 0.4, point.z);
  const double sensor = 12.8e-3 * std::sqrt(1.04), total = (d1 + d2) / 2 + return_path + sensor;
  const double each = 0.5 * 7e6 * 0.8 * 1e-3 / (total * total), omega = two_pi * 20e6;
  EXPECT_NEAR(std::abs(light.phasor), 2 * each * std::cos(omega * (d1 - d2) / (2 * speed_of_light)), 1e-9 * each);
  EXPECT_NEAR(std::arg(light.phasor), omega * total / speed_of_light, 1e-12);
  EXPECT_NEAR(light.intensity, 2 * each / (2 * 0.5), 1e-9 * each);
}

TEST(FourPhase, DecodesWhatTheCosinesSay) {
  for (double phase = 0; phase < two_pi; phase += 0.01) {
    std::array<double, 4> c{};
    for (std::size_t k = 0; k < 4; ++k) {  // with an offset and an even harmonic, which only the null channels show
      c[k] = 1234 * std::cos(phase + static_cast<double>(k) * std::numbers::pi / 2) + 17 + (k % 2 == 0 ? 5 : -5);
    }
    const Decoded decoded = decode(c);
    EXPECT_NEAR(std::remainder(decoded.phase - phase, two_pi), 0, 1e-12);
    EXPECT_TRUE(decoded.phase >= 0 && decoded.phase < two_pi);
    EXPECT_NEAR(decoded.amplitude, 1234, 1e-9);
    EXPECT_NEAR(decoded.null1, 17, 1e-9);
    EXPECT_NEAR(decoded.null2, 5, 1e-9);
    const auto ideal = samples_of(std::polar(1234.0, phase));
    for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(ideal[k], c[k] - 17 - (k % 2 == 0 ? 5 : -5), 1e-9);
  }
  EXPECT_EQ(decode({1, 1e-300, 0, 0}).phase, 0) << "2 pi itself is not in the range";
}

TEST(PhaseDecoding, EndsBelowTheRange) {
  const PhaseDecoding decoding(Exposures{{0, 0}, {two_pi / 3, 0}, {2 * two_pi / 3, 0}}, 20e6);
  // Phases within 1e-14 of 0; some of the negative ones are so small that the range plus their distance is the range.
  for (int i = -1000; i <= 1000; ++i) {
    const double distance = decoding({1, 0, i * 1e-17}).distance;
    ASSERT_GE(distance, 0) << i;
    ASSERT_LT(distance, decoding.range()) << i;
  }
}

TEST(FourPhase, NoiseIsWhatManySamplesShow) {
  std::mt19937_64 generator(7);
  const TapNoise noise{.read_noise = 12, .shot_noise = 0.5};
  const double amplitude = 900, intensity = 1500;
  std::normal_distribution<double> tap(0, std::sqrt(12.0 * 12 + 0.5 * intensity));
  double sum = 0;
  constexpr int count = 200000;
  for (int i = 0; i < count; ++i) {
    auto c = samples_of(std::polar(amplitude, 1.0));
    for (double& sample : c) sample += tap(generator) - tap(generator);
    const double error = metres_per_radian(20e6) * (decode(c).phase - 1.0);
    sum += error * error;
  }
  const double expected = std::sqrt(sum / count);  // known to 1/sqrt(2 count) = 0.16 %
  EXPECT_NEAR(distance_sigma(noise.sample_variance(intensity), amplitude, 20e6), expected, 0.005 * expected);
}

TEST(Constants, OfTheCamCube) {
  EXPECT_NEAR(unambiguous_range(20e6), 7.4948, 0.0001);
  EXPECT_NEAR(metres_per_radian(20e6) * two_pi, unambiguous_range(20e6), 1e-12);
}

TEST(Random, GivesThePublishedWords) {  // the test vectors that come with the authors' own library
  EXPECT_EQ(philox({0, 0, 0, 0}, {0, 0}), (RandomWords{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  constexpr std::uint32_t ones = 0xffffffff;
  EXPECT_EQ(philox({ones, ones, ones, ones}, {ones, ones}),
            (RandomWords{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (RandomWords{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(Random, NormalNumbersAreNormal) {
  double sum = 0, squares = 0, fourth = 0, cross = 0;
  constexpr std::uint32_t count = 250000;
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto x = normal_numbers(3, 4, i);
    for (const double v : x) {
      sum += v;
      squares += v * v;
      fourth += v * v * v * v;
    }
    cross += x[0] * x[1] + x[1] * x[2] + x[2] * x[3];
  }
  constexpr double n = 4.0 * count;  // five standard deviations of each statistic
  EXPECT_NEAR(sum / n, 0, 5 / std::sqrt(n));
  EXPECT_NEAR(squares / n, 1, 5 * std::sqrt(2 / n));
  EXPECT_NEAR(fourth / n, 3, 5 * std::sqrt(96 / n));
  EXPECT_NEAR(cross / (3.0 * count), 0, 5 / std::sqrt(3.0 * count));
}

}  // namespace
