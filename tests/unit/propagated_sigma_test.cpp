// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The sigma stated by the distance models, compared with the standard deviation of their depths, by Monte Carlo.
#include <gtest/gtest.h>
#include <tofgraph/harness.hpp>

#include <cmath>
#include <random>
#include <string>
#include <vector>

namespace tofgraph {
namespace {

constexpr std::size_t size = 204, frames = 12;
constexpr double noise = 0.004;  // m

/// Ratio of stated sigma to temporal standard deviation, root mean square, at a measured distance in m.
double stated_over_real(const std::string& line, double distance) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, noise);
  std::vector<double> sum(size * size), squares(size * size);
  double stated = 0, real = 0;
  for (std::size_t f = 0; f < frames; ++f) {
    Harness stage(line);
    stage.camera("camcube2");
    std::vector<float> measured(size * size);
    for (float& value : measured) value = static_cast<float>(distance + normal(random));
    stage.put<float>("distance", {size, size}, measured);
    stage.put<float>("sigma", {size, size}, std::vector<float>(size * size, static_cast<float>(noise)),
                     {.unit = "m", .of = "distance", .applied = "", .from = ""});
    stage.run();
    const auto depth = stage.get<float>("depth"), sigma = stage.get<float>("sigma");
    for (std::size_t i = 0; i < depth.size(); ++i) {
      const double value = static_cast<double>(depth[i]) - distance;
      sum[i] += value;
      squares[i] += value * value;
      stated += std::pow(static_cast<double>(sigma[i]), 2) / frames;
    }
  }
  for (std::size_t i = 0; i < sum.size(); ++i) real += (squares[i] - sum[i] * sum[i] / frames) / (frames - 1);
  return std::sqrt(stated / real);
}

/// Near the camera, where sources 50 mm to each side reduce the change of depth per distance, and far from it.
TEST(PropagatedSigma, IsTheSpreadOfTheDepth) {
  for (const char* model : {"perpendicular_illumination", "simple_bistatic", "optimized_bistatic"})
    for (const double distance : {0.25, 3.0})
      EXPECT_NEAR(stated_over_real(model, distance), 1, 0.01) << model << distance;
}

}  // namespace
}  // namespace tofgraph
