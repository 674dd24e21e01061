// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The perpendicular and the simple bistatic model, compared with their own forward equations, implemented here from the
// reference's path lengths, and with the figures of its table 5.1.
#include <tofgraph/channels.hpp>
#include <tofgraph/harness.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tofgraph {
namespace {

constexpr std::size_t size = 204, pixels = size * size;
constexpr double f = 12.8e-3, pitch = 40e-6;

struct Pixel {
  double xs, ys, cosine, sensor;
};

Pixel pixel(std::size_t i) {
  const double xs = (static_cast<double>(i % size) - 101.5) * pitch,
               ys = (static_cast<double>(i / size) - 101.5) * pitch;
  const double sensor = std::sqrt(xs * xs + ys * ys + f * f);
  return {xs, ys, f / sensor, sensor};
}

double source_path(const Pixel& p, double z, double source) {
  const double x = p.xs / f * (z - f), y = p.ys / f * (z - f);
  return std::sqrt((x - source) * (x - source) + y * y + z * z);
}

/// Distance of a board for the ideal camera: two sources at +-50 mm.
double board_distance(const Pixel& p, double z) {
  return ((source_path(p, z, 0.05) + source_path(p, z, -0.05)) / 2 + (z - f) / p.cosine + p.sensor) / 2;
}

struct Moments {
  double mean = 0, deviation = 0;
};

Moments moments(const std::vector<float>& values) {
  Moments m;
  for (const float v : values) m.mean += v / static_cast<double>(values.size());
  for (const float v : values) m.deviation += (v - m.mean) * (v - m.mean);
  m.deviation = std::sqrt(m.deviation / (static_cast<double>(values.size()) - 1));
  return m;
}

std::vector<float> corrected(const std::string& stage_line, const std::vector<float>& distance) {
  Harness stage(stage_line);
  stage.camera("camcube2");
  stage.put<float>("distance", {size, size}, distance);
  stage.run();
  return stage.get<float>("depth");
}

TEST(LinearModels, InvertTheirForwardFormTo2Micrometres) {
  double worst_perpendicular = 0, worst_bistatic = 0;
  for (double d = 0.3; d <= 7.4; d += 0.71) {
    const double plane = d;
    std::vector<float> perpendicular(pixels), bistatic(pixels);
    std::vector<double> z(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
      const Pixel p = pixel(i);
      z[i] = d * (0.9 + 0.1 * static_cast<double>(i % 11) / 10);
      const double return_path = (z[i] - f) / p.cosine;
      const double g = (source_path(p, plane, 0.05) + source_path(p, plane, -0.05)) / 2 / plane;
      perpendicular[i] = static_cast<float>((z[i] + return_path + p.sensor) / 2);
      bistatic[i] = static_cast<float>((z[i] * g + return_path + p.sensor) / 2);
    }
    const auto a = corrected("perpendicular_illumination", perpendicular);
    const auto b = corrected("simple_bistatic plane_depth='" + std::to_string(plane) + " m'", bistatic);
    for (std::size_t i = 0; i < pixels; ++i) {
      worst_perpendicular = std::max(worst_perpendicular, std::abs(a[i] - z[i]));
      worst_bistatic = std::max(worst_bistatic, std::abs(b[i] - z[i]));
    }
  }
  EXPECT_LT(worst_perpendicular, 2e-6);
  EXPECT_LT(worst_bistatic, 2e-6);
}

TEST(LinearModels, GiveTheFiguresOfTheReferencesWhiteBoard) {
  // equations.md section 5: a board at 505.02 mm, noise on D of 2.77 mm; mean and sd in mm.
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0, 2.77e-3);
  std::vector<float> distance(pixels);
  for (std::size_t i = 0; i < pixels; ++i)
    distance[i] = static_cast<float>(board_distance(pixel(i), 0.50502) + noise(random));
  const auto expect = [](const std::vector<float>& values, double mean, double deviation, const char* what) {
    const Moments m = moments(values);
    EXPECT_NEAR(m.mean * 1e3, mean, 0.05) << what;
    EXPECT_NEAR(m.deviation * 1e3, deviation, 0.05) << what;
  };
  expect(distance, 522.48, 10.48, "measured");
  expect(corrected("perpendicular_illumination", distance), 513.93, 5.44, "perpendicular");
  expect(corrected("simple_bistatic plane_depth='500 mm'", distance), 504.99, 2.67, "simple bistatic");
  expect(corrected("optimized_bistatic", distance), 505.01, 2.68, "optimized");
}

TEST(SimpleBistatic, EstimatesTheDepthOfABoard) {
  for (const double z : {0.3, 0.5, 1.0, 3.0, 7.0}) {
    std::vector<float> distance(pixels);
    for (std::size_t i = 0; i < pixels; ++i)
      distance[i] = i % 10 == 0 ? NAN : static_cast<float>(board_distance(pixel(i), z));
    const auto depth = corrected("simple_bistatic", distance);
    double worst = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
      if (i % 10 != 0) worst = std::max(worst, std::abs(depth[i] - z));
      ASSERT_EQ(std::isnan(depth[i]), i % 10 == 0);
    }
    EXPECT_LT(worst, 1e-5) << z;
  }
}

TEST(LinearModels, GiveNoNumberWhereThereIsNoSolution) {
  for (const char* line : {"perpendicular_illumination", "simple_bistatic plane_depth='1 m'", "simple_bistatic"}) {
    Harness stage(line);
    stage.camera("camcube2");
    std::vector<float> distance(pixels, 1.0F);
    distance[0] = NAN;
    distance[1] = 0;
    distance[2] = 0.001F;
    distance[3] = INFINITY;
    distance[4] = -1;
    std::vector<std::uint16_t> flags(pixels, 0);
    flags[5] = flag::invalid | flag::saturated;
    stage.put<float>("distance", {size, size}, distance);
    stage.put<float>("sigma", {size, size}, std::vector<float>(pixels, 0.01F),
                     {.unit = "m", .of = "distance", .applied = "", .from = ""});
    stage.put<std::uint16_t>("flags", {size, size}, flags);
    stage.run();
    const auto depth = stage.get<float>("depth"), sigma = stage.get<float>("sigma");
    const auto out = stage.get<std::uint16_t>("flags");
    for (std::size_t i = 0; i < 6; ++i) {
      EXPECT_TRUE(std::isnan(depth[i])) << line << i;
      EXPECT_TRUE(std::isnan(sigma[i])) << line << i;
      EXPECT_EQ(out[i] & flag::invalid, flag::invalid) << line << i;
    }
    EXPECT_EQ(out[5] & flag::saturated, flag::saturated);
    EXPECT_EQ(out[6], 0);
    EXPECT_NEAR(depth[pixels / 2 + size / 2], 1.0, 0.05);
    EXPECT_EQ(stage.of("sigma"), "depth");
  }
}

TEST(LinearModels, PropagateSigmaByTheirSlope) {
  for (const char* line : {"perpendicular_illumination", "simple_bistatic plane_depth='600 mm'"}) {
    const std::vector<float> base(pixels, 0.6F), moved(pixels, 0.601F);
    const auto a = corrected(line, base), b = corrected(line, moved);
    Harness stage(line);
    stage.camera("camcube2");
    stage.put<float>("distance", {size, size}, base);
    stage.put<float>("sigma", {size, size}, std::vector<float>(pixels, 0.001F),
                     {.unit = "m", .of = "distance", .applied = "", .from = ""});
    stage.run();
    const auto sigma = stage.get<float>("sigma");
    for (std::size_t i = 0; i < pixels; i += 997) EXPECT_NEAR(sigma[i], b[i] - a[i], 2e-6) << line;
  }
}

TEST(SimpleBistatic, SaysWhatIsWrong) {
  EXPECT_THROW(Harness("simple_bistatic plane_depth=500"), std::runtime_error);
  EXPECT_THROW(Harness("simple_bistatic plane_depth='-1 m'"), std::runtime_error);
  Harness unknown("perpendicular_illumination");
  unknown.camera("o3d303");
  unknown.put<float>("distance", {132, 176}, std::vector<float>(132 * 176, 1.0F));
  try {
    unknown.run();
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("has no focal length in metres"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("point_cloud assume=range"), std::string::npos);
  }
}

}  // namespace
}  // namespace tofgraph
