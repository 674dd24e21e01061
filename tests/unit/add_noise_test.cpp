// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <tofgraph/channels.hpp>
#include <tofgraph/harness.hpp>
#include <tofgraph/physics/random.hpp>

#include <cmath>
#include <numeric>

namespace tofgraph {
namespace {

constexpr std::size_t rows = 200, columns = 250;

struct Noisy {
  std::vector<float> depth, sigma;
  std::vector<std::uint16_t> flags;
};

Noisy noisy(const std::string& line, float length, const std::vector<float>& sigma = {}, std::uint64_t number = 0) {
  Harness stage(line);
  stage.put<float>("depth", {rows, columns}, std::vector<float>(rows * columns, length));
  if (!sigma.empty())
    stage.put<float>("sigma", {rows, columns}, sigma, {.unit = "m", .of = "depth", .applied = "", .from = ""});
  stage.metadata().number = number;
  stage.run();
  return {stage.get<float>("depth"), stage.get<float>("sigma"), stage.get<std::uint16_t>("flags")};
}

TEST(AddNoise, HasTheStatedDeviationAndNoCorrelation) {
  const Noisy n = noisy("add_noise deviation='10 mm'", 1);
  double sum = 0, squares = 0, fourth = 0, neighbours = 0;
  for (std::size_t i = 0; i < n.depth.size(); ++i) {
    const double e = (static_cast<double>(n.depth[i]) - 1) / 0.010;
    sum += e;
    squares += e * e;
    fourth += e * e * e * e;
    if (i > 0) neighbours += e * (static_cast<double>(n.depth[i - 1]) - 1) / 0.010;
  }
  const auto count = static_cast<double>(n.depth.size());
  EXPECT_NEAR(sum / count, 0, 4 / std::sqrt(count));
  EXPECT_NEAR(squares / count, 1, 4 * std::sqrt(2 / count));
  EXPECT_NEAR(fourth / count, 3, 4 * std::sqrt(96 / count)) << "the fourth moment of a normal distribution is 3";
  EXPECT_NEAR(neighbours / count, 0, 4 / std::sqrt(count));
  for (const float s : n.sigma) ASSERT_FLOAT_EQ(s, 0.010F);
}

TEST(AddNoise, RepeatsWithItsSeedAndDiffersByFrame) {
  const std::string line = "add_noise deviation='10 mm'";
  EXPECT_EQ(noisy(line, 1).depth, noisy(line, 1).depth);
  EXPECT_NE(noisy(line, 1).depth, noisy(line, 1, {}, 1).depth);
  EXPECT_NE(noisy(line, 1).depth, noisy(line + " seed=2", 1).depth);
}

TEST(AddNoise, IsIndependentOfSimulatedFramesWithTheSameSeed) {
  const Noisy n = noisy("add_noise deviation='10 mm' seed=1", 1);
  double product = 0;  // with the first numbers of a pixel, which are the noise of the first image of a simulated frame
  for (std::size_t i = 0; i < n.depth.size(); ++i) {
    const double simulated = physics::normal_numbers(1, 0, static_cast<std::uint32_t>(i))[0];
    product += (static_cast<double>(n.depth[i]) - 1) / 0.010 * simulated;
  }
  const auto count = static_cast<double>(n.depth.size());
  EXPECT_NEAR(product / count, 0, 4 / std::sqrt(count));
}

TEST(AddNoise, CombinesWithSigmaAndKeepsInvalidPixels) {
  std::vector<float> sigma(rows * columns, 0.003F);
  EXPECT_NEAR(noisy("add_noise deviation='4 mm'", 1, sigma).sigma[77], 0.005F, 1e-7F);
  const Noisy none = noisy("add_noise deviation='4 mm'", 0);
  EXPECT_TRUE(std::isnan(none.depth[5]));
  EXPECT_EQ(none.flags[5] & flag::invalid, flag::invalid);
  const Noisy near = noisy("add_noise deviation='10 mm'", 0.001F);  // half of the noisy lengths are negative
  std::size_t invalid = 0;
  for (std::size_t i = 0; i < near.depth.size(); ++i) {
    invalid += std::isnan(near.depth[i]) ? 1 : 0;
    ASSERT_EQ(std::isnan(near.depth[i]), (near.flags[i] & flag::invalid) != 0);
    ASSERT_FALSE(near.depth[i] <= 0);
  }
  EXPECT_NEAR(static_cast<double>(invalid) / static_cast<double>(rows * columns), 0.460, 0.01);  // Phi(-0.1)
}

}  // namespace
}  // namespace tofgraph
