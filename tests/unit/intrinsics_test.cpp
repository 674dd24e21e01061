// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The replaced lens, compared with OpenCV's inverse of it; rectified images, compared with OpenCV's maps and remap.
#include <gtest/gtest.h>
#include <tofgraph/harness.hpp>

#include "tests/unit/cameras.hpp"
#include "tests/unit/message_of.hpp"

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include <cmath>
#include <random>

using namespace tofgraph;

namespace {

constexpr std::size_t pixels = 204 * 204;

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

constexpr const char* calibrated_lens =
    "fx=\"316.75 px\" fy=\"317 px\" cx=\"101.3 px\" cy=\"101.7 px\" k1=-0.44287 k2=0.21777 p1=0.00213 p2=-0.00497";

/// A calibration file that is deleted at the end of the test.
struct CalibrationFile {
  explicit CalibrationFile(const std::string& text)
      : path(std::filesystem::temp_directory_path() / ("tofgraph_calibration_" + std::to_string(getpid()) + ".yaml")) {
    std::ofstream(path) << text;
  }
  ~CalibrationFile() { std::filesystem::remove(path); }
  std::string error(const std::string& more = "") const {
    Harness stage("intrinsics calibration=" + path.string() + more);
    stage.camera(test::profile_of(test::camcube2().view));
    return message_of([&] { stage.prepare(); });
  }
  std::filesystem::path path;
};

const std::string good_calibration =
    "calibration: 1\nkind: intrinsics\ncamera: test\nserial: C7\n"
    "inputs:\n  - {file: board.h5, sha256: " +
    std::string(64, 'a') +
    "}\nsettings: {fix_k3: true}\nvalues:\n"
    "  focal_length: {value: [316.75 px, 317 px], sd: [0.3 px, 0.3 px]}\n"
    "  principal_point: {value: [101.3 px, 101.7 px]}\n"
    "  distortion: {value: [-0.44287, 0.21777, 0.00213, -0.00497, 0], sd: [0.01, 0.05, 0.001, 0.001, 0]}\n";

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  return text.replace(text.find(what), what.size(), by);
}

TEST(Intrinsics, CalibrationFileGivesTheLens) {
  const CalibrationFile file(good_calibration);
  Harness stage("intrinsics calibration=" + file.path.string() + " k3=0.001");
  stage.camera(test::profile_of(test::camcube2().view));
  stage.run();
  const tofgraph_camera& camera = stage.camera_out();
  EXPECT_EQ(camera.focal_px[0], 316.75);
  EXPECT_EQ(camera.focal_px[1], 317);
  EXPECT_NEAR(camera.focal_length, (316.75 + 317) / 2 * 40e-6, 1e-12);
  EXPECT_EQ(camera.principal_point[0], 101.3);
  EXPECT_EQ(camera.distortion[0], -0.44287);
  EXPECT_EQ(camera.distortion[3], -0.00497);
  EXPECT_EQ(camera.distortion[4], 0.001) << "what is written at the node wins";
}

TEST(Intrinsics, SkewAndRationalTermsOfACalibrationAreUsed) {
  const CalibrationFile file(good_calibration + "  rational: {value: [0.02, -0.01, 0.005]}\n  skew: {value: 0.01}\n");
  Harness stage("intrinsics calibration=" + file.path.string() + " k6=0.004");
  stage.camera(test::profile_of(test::camcube2().view));
  stage.run();
  const std::vector<double> coefficients = {-0.44287, 0.21777, 0.00213, -0.00497, 0, 0.02, -0.01, 0.004};
  const auto rays = stage.get<float>("rays");
  for (std::size_t i = 0; i < pixels; i += 101) {
    const auto u = static_cast<double>(i % 204), v = static_cast<double>(i / 204);
    std::vector<cv::Point2d> distorted;
    cv::projectPoints(std::vector<cv::Point3d>{{rays[3 * i] / rays[3 * i + 2], rays[3 * i + 1] / rays[3 * i + 2], 1}},
                      cv::Vec3d(), cv::Vec3d(), cv::Mat::eye(3, 3, CV_64F), coefficients, distorted);
    ASSERT_NEAR(316.75 * (distorted[0].x + 0.01 * distorted[0].y) + 101.3, u, 3e-4) << i;
    ASSERT_NEAR(317 * distorted[0].y + 101.7, v, 3e-4) << i;
  }
  EXPECT_EQ(stage.camera_out().skew, 0.01);
}

TEST(Intrinsics, RectifiedImagesHaveNeitherSkewNorRationalTerms) {
  test::Camera camera = test::camcube2();
  camera.view.skew = 0.02;
  camera.view.further_distortion[0] = 0.05;
  camera.make_rays();
  Harness stage("intrinsics rectify=true");
  stage.camera(test::profile_of(camera.view));
  std::vector<float> column(pixels);
  for (std::size_t i = 0; i < pixels; ++i) column[i] = static_cast<float>(i % 204);
  stage.put<float>("amplitude", {204, 204}, column, {.unit = "counts"});
  stage.run();
  EXPECT_EQ(stage.camera_out().skew, 0);
  EXPECT_EQ(stage.camera_out().further_distortion[0], 0);
  const std::vector<double> coefficients = {0, 0, 0, 0, 0, 0.05, 0, 0};
  const auto seen = stage.get<float>("amplitude");
  for (const std::size_t i : {std::size_t{40} * 204 + 60, std::size_t{102} * 204 + 102, std::size_t{160} * 204 + 120}) {
    const double x = (static_cast<double>(i % 204) - 101.5) / 320, y = (static_cast<double>(i / 204) - 101.5) / 320;
    std::vector<cv::Point2d> distorted;
    cv::projectPoints(std::vector<cv::Point3d>{{x, y, 1}}, cv::Vec3d(), cv::Vec3d(), cv::Mat::eye(3, 3, CV_64F),
                      coefficients, distorted);
    EXPECT_NEAR(seen[i], 320 * (distorted[0].x + 0.02 * distorted[0].y) + 101.5, 1e-3) << i;
  }
}

TEST(Intrinsics, CalibrationFileThatIsWrongIsToldWithItsPlace) {
  const auto error_of = [](const std::string& what, const std::string& by) {
    return CalibrationFile(replaced(good_calibration, what, by)).error();
  };
  const auto has = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos ? "" : "no '" + part + "' in:\n" + text;
  };
  EXPECT_EQ(has(error_of("kind: intrinsics", "kind: offset"), ".yaml:2:7: error: the calibration's kind is"), "");
  EXPECT_EQ(has(error_of("camera: test", "camera: o3"), ".yaml:3:9: error: the calibration's camera is"), "");
  EXPECT_EQ(has(error_of("calibration: 1", "calibration: 2"), "newer than this program"), "");
  EXPECT_EQ(has(error_of("[316.75 px, 317 px]", "[12.8 mm, 12.8 mm]"), ".yaml:9:26: error: 'value' holds"), "");
  EXPECT_EQ(has(error_of("[316.75 px, 317 px]", "[317 px]"), "'value' needs 2 numbers, but has 1"), "");
  EXPECT_EQ(has(error_of("  distortion:", "  distorsion:"), "has no key 'distorsion'"), "");
  EXPECT_EQ(has(error_of("  distortion:", "  distorsion:"), "'values' has no 'distortion'"), "");
  EXPECT_EQ(has(error_of("serial", "seriel"), ".yaml:4:1: error: the calibration has no key 'seriel'"), "");
  EXPECT_EQ(has(error_of("aaaa", "aaa"), "expected 64 hexadecimal digits"), "");
  EXPECT_EQ(has(error_of("316.75 px", "-316.75 px"), "'focal_length' must be positive"), "");
  EXPECT_EQ(has(error_of("[0.3 px", "[-0.3 px"), "'sd' of 'focal_length' is negative"), "");
  EXPECT_EQ(has(CalibrationFile("profile: 1\n").error(), "this is a profile, expected a calibration"), "");
}

/// OpenCV's map of the calibrated lens: source position of each pixel of the rectified image.
void opencv_maps(cv::Mat& x, cv::Mat& y) {
  const cv::Mat matrix = (cv::Mat_<double>(3, 3) << 316.75, 0, 101.3, 0, 317, 101.7, 0, 0, 1);
  const std::vector<double> distortion = {-0.44287, 0.21777, 0.00213, -0.00497, 0};
  cv::initUndistortRectifyMap(matrix, distortion, cv::noArray(), matrix, {204, 204}, CV_32FC1, x, y);
}

TEST(Intrinsics, RectifiesAsOpenCvDoes) {
  // Interpolated linearly, an image of the columns (rows) gives the map itself; a random one shows the pixels used.
  std::vector<float> column(pixels), row(pixels), noise(pixels);
  std::mt19937 random(5);
  for (std::size_t i = 0; i < pixels; ++i) {
    column[i] = static_cast<float>(i % 204);
    row[i] = static_cast<float>(i / 204);
    noise[i] = std::uniform_real_distribution<float>(0, 1)(random);
  }
  Harness stage(std::string("intrinsics rectify=true ") + calibrated_lens);
  stage.camera(test::profile_of(test::camcube2().view));
  stage.put<float>("distance", {204, 204}, column);
  stage.put<float>("amplitude", {204, 204}, row);
  stage.put<float>("intensity", {204, 204}, noise);
  stage.run();
  cv::Mat x, y, mixed;
  opencv_maps(x, y);
  cv::remap(cv::Mat(204, 204, CV_32F, noise.data()), mixed, x, y, cv::INTER_LINEAR);
  const auto columns = stage.get<float>("distance"), rows = stage.get<float>("amplitude"),
             values = stage.get<float>("intensity");
  const auto flags = stage.get<std::uint16_t>("flags");
  std::size_t inside = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const float u = x.ptr<float>()[i], v = y.ptr<float>()[i];
    const bool within = u >= 0 && v >= 0 && u <= 203 && v <= 203;
    ASSERT_EQ(flags[i], within ? 0 : 1) << i;
    ASSERT_EQ(std::isnan(columns[i]), !within) << i;
    if (!within) continue;
    ++inside;
    ASSERT_NEAR(columns[i], u, 5e-5) << i;
    ASSERT_NEAR(rows[i], v, 5e-5) << i;
    // OpenCV rounds the position to 1/32 px: up to 1/64 px times differences of up to 1, in x and in y.
    ASSERT_NEAR(values[i], mixed.ptr<float>()[i], 2.0 / 64) << i;
  }
  EXPECT_GT(inside, pixels * 9 / 10);
  for (const double coefficient : stage.camera_out().distortion) EXPECT_EQ(coefficient, 0);
  const auto rays = stage.get<float>("rays");
  EXPECT_NEAR(rays[3 * 203] / rays[3 * 203 + 2], (203 - 101.3) / 316.75, 1e-6) << "a pinhole's";
  EXPECT_EQ(stage.applied("distance"), "rectified");
}

TEST(Intrinsics, RectifiedPixelIsInvalidWhenOneOfItsFourSourcesIs) {
  const std::size_t hole = 60 * 204 + 40;
  std::vector<float> distance(pixels, 2.0F), amplitude(pixels, 100.0F), sigma(pixels, 0.01F);
  std::vector<std::uint16_t> arrived(pixels, 0), taps(8 * pixels, 7);
  distance[hole] = sigma[hole] = std::nanf("");
  arrived[hole] = 1 | 8;
  taps[3 * pixels + hole] = 20007;
  taps[5 * pixels + hole] = 30000;  // the full well
  Harness stage(std::string("intrinsics rectify=true ") + calibrated_lens);
  stage.camera(test::profile_of(test::camcube2().view));
  stage.put<std::uint16_t>("taps", {4, 2, 204, 204}, taps);
  stage.put<float>("distance", {204, 204}, distance);
  stage.put<float>("amplitude", {204, 204}, amplitude);
  stage.put<float>("sigma", {204, 204}, sigma, {.of = "distance"});
  stage.put<std::uint16_t>("flags", {204, 204}, arrived);
  stage.run();
  cv::Mat x, y;
  opencv_maps(x, y);
  const auto d = stage.get<float>("distance"), a = stage.get<float>("amplitude"), s = stage.get<float>("sigma");
  const auto bits = stage.get<std::uint16_t>("flags"), samples = stage.get<std::uint16_t>("taps");
  std::size_t touched = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const double u = x.ptr<float>()[i], v = y.ptr<float>()[i];
    if (!(u >= 0 && v >= 0 && u <= 203 && v <= 203)) continue;
    const double near_u = 1 - std::abs(u - 40), near_v = 1 - std::abs(v - 60);
    const bool takes_part = near_u > 0 && near_v > 0;
    touched += takes_part ? 1U : 0U;
    ASSERT_EQ(bits[i], takes_part ? 9 : 0) << i;
    ASSERT_EQ(std::isnan(d[i]), takes_part) << i;
    ASSERT_EQ(std::isnan(s[i]), takes_part) << i;
    ASSERT_NEAR(a[i], 100, 1e-3) << "keeps what was measured";
    const double part = takes_part ? near_u * near_v : 0;
    ASSERT_NEAR(samples[3 * pixels + i], 7 + part * 20000, 10) << i;
    ASSERT_EQ(samples[5 * pixels + i], takes_part ? 30000 : 7) << "stays saturated, " << i;
    ASSERT_EQ(samples[4 * pixels + i], 7) << i;
    if (takes_part) continue;
    // Four independent values of equal standard deviation: 0.01 times the root of the sum of the squared weights.
    const double p = u - std::floor(u), q = v - std::floor(v);
    const double weights = ((1 - p) * (1 - p) + p * p) * ((1 - q) * (1 - q) + q * q);
    ASSERT_NEAR(s[i], 0.01 * std::sqrt(weights), 1e-6) << i;
  }
  EXPECT_GE(touched, 4U);
}

TEST(Intrinsics, RectifyingAPinholeChangesNothing) {
  std::vector<float> distance(pixels);
  for (std::size_t i = 0; i < pixels; ++i) distance[i] = 1 + 0.001F * static_cast<float>(i % 977);
  distance[1000] = std::nanf("");
  Harness stage("intrinsics rectify=true");
  stage.camera(test::profile_of(test::camcube2().view));
  stage.put<float>("distance", {204, 204}, distance);
  stage.run();
  const auto out = stage.get<float>("distance");
  for (std::size_t i = 0; i < pixels; ++i) {
    if (i == 1000) continue;
    ASSERT_EQ(out[i], distance[i]) << i;
  }
  EXPECT_TRUE(std::isnan(out[1000]));
  EXPECT_EQ(stage.get<std::uint16_t>("flags")[1000], 1);
}

TEST(Intrinsics, RefusesToRectifyWhereThereIsNothingOrTooLate) {
  const std::string profile = test::profile_of(test::camcube2().view);
  Harness nowhere("intrinsics rectify=true cx=\"9000 px\" k1=-0.001");
  nowhere.camera(profile);
  nowhere.put<float>("distance", {204, 204}, std::vector<float>(pixels, 1));
  EXPECT_NE(message_of([&] { nowhere.prepare(); }).find("no pixel of the rectified image"), std::string::npos);
  Harness late("intrinsics rectify=true");
  late.camera(profile);
  late.put<float>("points", {204, 204, 3}, std::vector<float>(3 * pixels, 1),
                  {.unit = "m", .of = "", .applied = "optimized_bistatic point_cloud", .from = ""});
  EXPECT_NE(message_of([&] { late.prepare(); }).find("the input already has points"), std::string::npos);
  Harness recorded("intrinsics rectify=true");
  recorded.camera(profile);
  recorded.put<float>("points", {204, 204, 3}, std::vector<float>(3 * pixels, 1));
  EXPECT_NE(message_of([&] { recorded.prepare(); }).find("read the recording without them"), std::string::npos);
  Harness kept("intrinsics k1=-0.1");
  kept.camera(profile);
  kept.put<float>("points", {204, 204, 3}, std::vector<float>(3 * pixels, 1));
  kept.prepare();
  ASSERT_EQ(kept.messages().size(), 1U);
  EXPECT_NE(kept.messages()[0].find("keep the lens they were computed with"), std::string::npos) << kept.messages()[0];
  Harness folded("intrinsics rectify=true k1=-3");
  folded.camera(profile);
  folded.put<float>("distance", {204, 204}, std::vector<float>(pixels, 1));
  folded.run();
  // 1 + 3 k1 r^2 = 0 at r = 1/3: beyond it, the model folds over. The corner has r = 101.5/320 sqrt(2) = 0.449.
  EXPECT_EQ(folded.get<std::uint16_t>("flags")[0], 64 | 1);
  EXPECT_TRUE(std::isnan(folded.get<float>("distance")[0]));
}

}  // namespace
