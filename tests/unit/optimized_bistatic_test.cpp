// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: OptimizedBistatic.BisectionIs*:OptimizedBistatic.InvertsFour*
// Rooms: plugins
// The optimized bistatic model, compared with an independent bisection of the equation in double precision.
#include <gtest/gtest.h>
#include <tofgraph/channels.hpp>
#include <tofgraph/harness.hpp>

#include "tests/unit/cameras.hpp"
#include "tests/unit/message_of.hpp"
#include "tests/unit/processors.hpp"
#include "tests/unit/thesis_table.hpp"

#include <cmath>
#include <random>

using namespace tofgraph;

namespace {

using Sources = std::vector<tofgraph_light>;

const Sources one = {{"one", {0.05, 0.01, 0.002}, 1}};
const Sources two = {{"left", {-0.05, 0, 0}, 1}, {"right", {0.05, 0, 0}, 1}};
const Sources four = {{"a", {-0.09, -0.06, 0.01}, 1},
                      {"b", {0.08, -0.05, 0}, 0.5},
                      {"c", {-0.1, 0.07, -0.02}, 2},
                      {"d", {0.03, 0.04, 0.03}, 0.7}};
const Sources wide = {{"a", {-0.7, 0.2, 0.1}, 1}, {"b", {0.6, 0, -0.3}, 1}, {"c", {0, 0.4, 0}, 3}};
const Sources ahead = {{"a", {0.01, 0.02, 1.5}, 1}, {"b", {-0.3, 0, 0.8}, 2}};  // between the camera and the scene

constexpr double focal = 12.8e-3, pitch = 40e-6;

/// D of the point at this depth seen by the pixel, and D_ref for a depth, from the pinhole model alone.
struct Pixel {
  double x, y, cosine, sensor;  // sensor plane in metres; cos(theta); D_sen

  explicit Pixel(std::size_t i)
      : x((static_cast<double>(i % 204) - 101.5) * pitch),
        y((static_cast<double>(i / 204) - 101.5) * pitch),
        cosine(focal / std::sqrt(x * x + y * y + focal * focal)),
        sensor(focal / cosine) {}

  double distance(const Sources& sources, double depth) const {
    const double px = x / focal * (depth - focal), py = y / focal * (depth - focal);
    double sum = 0, total = 0;
    for (const auto& s : sources) {
      sum += s.amplitude * std::sqrt(std::pow(px - s.position[0], 2) + std::pow(py - s.position[1], 2) +
                                     std::pow(depth - s.position[2], 2));
      total += s.amplitude;
    }
    return (sum / total + (depth - focal) / cosine + sensor) / 2;
  }

  double depth(const Sources& sources, double measured) const {
    double low = focal, high = 2 * measured + 10;
    if (distance(sources, low) >= measured) return std::nan("");
    for (int i = 0; i < 80; ++i) {
      const double middle = (low + high) / 2;
      (distance(sources, middle) < measured ? low : high) = middle;
    }
    return low;
  }
};

constexpr std::size_t pixels = 204 * 204;

/// @param tolerance m, of the depth @param steep a small step of D is a large step of z: the tolerance applies to the
/// distance
void inverts(const Sources& sources, const std::string& line, double tolerance, bool steep = false) {
  const test::Camera camera = test::camcube2(sources);
  const std::string profile = test::profile_of(camera.view);
  std::mt19937 generator(5);
  std::uniform_real_distribution<float> any(0.3F, 7.4F);
  std::vector<std::vector<float>> frames(4, std::vector<float>(pixels));
  for (std::size_t i = 0; i < pixels; ++i) {
    frames[0][i] = 0.3F;
    frames[1][i] = 7.4F;
    frames[2][i] = any(generator);
    frames[3][i] = 0.3F + 0.5F * static_cast<float>(i) / pixels;
  }
  std::vector<std::vector<double>> expected;
  for (const auto& distances : frames) {
    auto& depths = expected.emplace_back();
    for (std::size_t i = 0; i < pixels; ++i) depths.push_back(Pixel(i).depth(sources, distances[i]));
  }
  test::on_each_processor([&](const std::string& processor) {
    Harness stage(line);
    stage.camera(profile);
    for (std::size_t k = 0; k < frames.size(); ++k) {
      stage.put<float>("distance", {204, 204}, frames[k]);
      stage.run();
      const auto depth = stage.get<float>("depth");
      const auto flags = stage.get<std::uint16_t>("flags");
      double worst = 0;
      for (std::size_t i = 0; i < pixels; ++i) {
        ASSERT_EQ(std::isnan(depth[i]), std::isnan(expected[k][i]))
            << processor << ", pixel " << i << ", D " << frames[k][i];
        ASSERT_EQ(flags[i], std::isnan(depth[i]) ? flag::invalid : 0);
        if (std::isnan(depth[i])) continue;
        const double of_depth = std::abs(depth[i] - expected[k][i]);
        const double of_distance = std::abs(Pixel(i).distance(sources, depth[i]) - frames[k][i]);
        worst = std::max(worst, steep ? of_distance : of_depth);
      }
      testing::Test::RecordProperty(processor + "_" + std::to_string(k) + "_um", std::to_string(worst * 1e6));
      EXPECT_LE(worst, tolerance) << processor << ", frame " << k;
    }
  });
}

TEST(OptimizedBistatic, InvertsOneSource) { inverts(one, "optimized_bistatic", 2e-6); }
TEST(OptimizedBistatic, InvertsTwoSources) { inverts(two, "optimized_bistatic", 2e-6); }
TEST(OptimizedBistatic, InvertsFourSourcesOfAnyAmplitude) { inverts(four, "optimized_bistatic", 2e-6); }
TEST(OptimizedBistatic, InvertsSourcesFarApart) { inverts(wide, "optimized_bistatic", 2e-6); }
TEST(OptimizedBistatic, InvertsSourcesAheadOfTheCamera) { inverts(ahead, "optimized_bistatic", 2e-6, true); }
TEST(OptimizedBistatic, BisectionIsTheReference) { inverts(two, "optimized_bistatic solver=bisection", 0.3e-6); }

TEST(OptimizedBistatic, GivesTheCalculatedBoard) {
  // A board at 505.02 mm, 2.77 mm of noise on D: the reference calculates 505.01 mm mean, 2.68 mm standard deviation.
  std::mt19937_64 generator(11);
  std::normal_distribution<double> noise(0, 2.77e-3);
  std::vector<float> distance(pixels);
  for (std::size_t i = 0; i < pixels; ++i)
    distance[i] = static_cast<float>(Pixel(i).distance(two, 0.50502) + noise(generator));
  Harness stage("optimized_bistatic");
  stage.camera(test::profile_of(test::camcube2().view));
  stage.put<float>("distance", {204, 204}, distance);
  stage.put<float>("sigma", {204, 204}, std::vector<float>(pixels, 2.77e-3F), {.of = "distance"});
  stage.run();
  const auto depth = stage.get<float>("depth"), sigma = stage.get<float>("sigma");
  const auto board =
      test::over_window(102, 102, [&](std::size_t row, std::size_t column) { return depth[row * 204 + column]; });
  EXPECT_NEAR(board.mean, 505.01e-3, 0.05e-3);
  EXPECT_NEAR(board.deviation, 2.68e-3, 0.05e-3);
  const auto predicted =
      test::over_window(102, 102, [&](std::size_t row, std::size_t column) { return sigma[row * 204 + column]; });
  EXPECT_NEAR(predicted.mean, board.deviation, 0.02e-3) << "sigma says what the noise shows";
  EXPECT_EQ(stage.of("sigma"), "depth");
}

TEST(OptimizedBistatic, NeverAWrongNumber) {
  const float nan = std::nanf(""), infinite = std::numeric_limits<float>::infinity();
  const std::vector<float> odd = {nan,   infinite, -infinite, -1,    -1e-30F, 0,  1e-30F, 0.001F,
                                  0.02F, 0.0321F,  0.0330F,   0.05F, 7.5F,    20, 150,    1e30F};
  for (const Sources& sources : {one, two, four}) {
    const std::string profile = test::profile_of(test::camcube2(sources).view);
    for (const std::string solver : {"newton", "bisection"}) {
      Harness stage("optimized_bistatic solver=" + solver);
      stage.camera(profile);
      std::vector<float> distance(pixels);
      for (std::size_t i = 0; i < pixels; ++i) distance[i] = odd[i % odd.size()];
      stage.put<float>("distance", {204, 204}, distance);
      stage.put<float>("sigma", {204, 204}, std::vector<float>(pixels, 1e-3F), {.of = "distance"});
      stage.run();
      const auto depth = stage.get<float>("depth"), sigma = stage.get<float>("sigma");
      const auto flags = stage.get<std::uint16_t>("flags");
      for (std::size_t i = 0; i < pixels; ++i) {
        ASSERT_EQ(std::isnan(depth[i]), flags[i] == flag::invalid);
        ASSERT_EQ(std::isnan(depth[i]), std::isnan(sigma[i]));
        const double expected =
            std::isfinite(distance[i]) && distance[i] < 1e6F ? Pixel(i).depth(sources, distance[i]) : std::nan("");
        if (distance[i] == 1e30F) continue;  // may be solved or rejected
        const double least = Pixel(i).distance(sources, focal);
        if (std::abs(distance[i] - least) < 1e-8) continue;  // the limit itself, in single precision
        ASSERT_EQ(std::isnan(depth[i]), std::isnan(expected)) << solver << " D " << distance[i];
        if (std::isnan(expected)) continue;
        ASSERT_NEAR(depth[i], expected, 2e-6 + 1.2e-7 * distance[i]) << solver << " D " << distance[i];
      }
    }
  }
}

TEST(OptimizedBistatic, SigmaFollowsTheSlope) {
  for (const Sources& sources : {one, two, four}) {
    const std::string profile = test::profile_of(test::camcube2(sources).view);
    std::vector<float> first;
    for (const std::string solver : {"newton", "bisection"}) {
      Harness stage("optimized_bistatic solver=" + solver);
      stage.camera(profile);
      std::vector<float> distance(pixels);
      for (std::size_t i = 0; i < pixels; ++i) distance[i] = 0.3F + 7 * static_cast<float>(i) / pixels;
      stage.put<float>("distance", {204, 204}, distance);
      stage.put<float>("sigma", {204, 204}, std::vector<float>(pixels, 1e-3F), {.of = "distance"});
      stage.run();
      const auto sigma = stage.get<float>("sigma");
      for (std::size_t i = 0; i < pixels; i += 97) {
        const double slope =
            (Pixel(i).depth(sources, distance[i] + 1e-6) - Pixel(i).depth(sources, distance[i] - 1e-6)) / 2e-6;
        EXPECT_NEAR(sigma[i], 1e-3 * slope, 1e-8) << solver;
      }
    }
  }
}

TEST(OptimizedBistatic, KeepsFlagsAndMarksPixelsOutsideTheLens) {
  test::Camera camera = test::camcube2();
  camera.view.distortion[0] = -3;  // no rays beyond 71 px from the centre
  Harness stage("optimized_bistatic");
  stage.camera(test::profile_of(camera.view));
  std::vector<std::uint16_t> flags(pixels);
  flags[101 * 204 + 101] = flag::user;
  flags[101 * 204 + 102] = flag::invalid | flag::saturated;
  stage.put<float>("distance", {204, 204}, std::vector<float>(pixels, 1.0F));
  stage.put<std::uint16_t>("flags", {204, 204}, flags);
  stage.run();
  const auto out = stage.get<std::uint16_t>("flags");
  const auto depth = stage.get<float>("depth");
  EXPECT_EQ(out[0], flag::invalid | flag::outside_lens);
  EXPECT_TRUE(std::isnan(depth[0]));
  EXPECT_EQ(out[101 * 204 + 101], flag::user);
  EXPECT_FALSE(std::isnan(depth[101 * 204 + 101]));
  EXPECT_EQ(out[101 * 204 + 102], flag::invalid | flag::saturated);
  EXPECT_TRUE(std::isnan(depth[101 * 204 + 102])) << "invalid stays invalid";
}

TEST(OptimizedBistatic, RefusesWhatItCannotSolve) {
  const std::vector<float> distance(pixels, 1.0F);
  test::Camera pixels_only = test::camcube2();
  pixels_only.view.focal_length = pixels_only.view.pitch[0] = pixels_only.view.pitch[1] = std::nan("");
  Harness metres("optimized_bistatic");
  metres.camera(test::profile_of(pixels_only.view));
  metres.put<float>("distance", {204, 204}, distance);
  EXPECT_NE(message_of([&] { metres.prepare(); }).find("no focal length in metres"), std::string::npos);

  Harness nobody("optimized_bistatic");
  nobody.put<float>("distance", {204, 204}, distance);
  EXPECT_NE(message_of([&] { nobody.prepare(); }).find("camera"), std::string::npos);

  Harness foreign("optimized_bistatic");
  foreign.camera(test::profile_of(test::camcube2().view));
  foreign.put<float>("distance", {204, 204}, distance);
  foreign.put<float>("sigma", {204, 204}, distance, {.of = "range"});
  EXPECT_NE(message_of([&] { foreign.prepare(); }).find("expected that of 'distance'"), std::string::npos);

  Harness twice("optimized_bistatic");
  twice.camera(test::profile_of(test::camcube2().view));
  twice.put<float>("distance", {204, 204}, distance);
  twice.put<float>("depth", {204, 204}, distance, {.applied = "optimized_bistatic", .from = "distance rays"});
  EXPECT_NE(message_of([&] { twice.prepare(); }).find("depth"), std::string::npos);

  Harness small("optimized_bistatic");
  small.camera(test::profile_of(test::camcube2().view));
  small.put<float>("distance", {2, 2}, std::vector<float>(4, 1.0F));
  EXPECT_NE(message_of([&] { small.run(); }).find("204 x 204"), std::string::npos);
}

}  // namespace
