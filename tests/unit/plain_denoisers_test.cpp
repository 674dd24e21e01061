// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// median, flying_pixels and temporal_kalman, compared with sorting, the true edges of the box scene and closed forms.
#include <tofgraph/channels.hpp>
#include <tofgraph/harness.hpp>

#include <gtest/gtest.h>

#include "tests/unit/denoise_reference.hpp"

namespace tofgraph {
namespace {

using test::Image;
constexpr std::uint64_t size = 204;
const Harness::Meaning of_depth{.unit = "m", .of = "depth", .applied = "", .from = ""};

TEST(Median, IsTheMiddleOfTheSortedValidPixels) {
  Image depth(size, size);
  test::add_noise(depth, 1, 5);
  for (float& value : depth.values) value += 6;  // lengths are positive
  test::drop_pixels(depth, 0.3, 6);
  Harness stage("median window=5");
  stage.put<float>("depth", {size, size}, depth.values);
  stage.run();
  const std::vector<float> found = stage.get<float>("depth");
  for (std::ptrdiff_t r = 0; r < depth.rows; ++r) {
    for (std::ptrdiff_t c = 0; c < depth.columns; ++c) {
      const float value = found[static_cast<std::size_t>(r * depth.columns + c)];
      ASSERT_EQ(std::isnan(value), !depth.valid(r, c));
      std::vector<double> sorted;
      for (std::ptrdiff_t y = r - 2; y <= r + 2; ++y)
        for (std::ptrdiff_t x = c - 2; x <= c + 2; ++x)
          if (depth.valid(y, x)) sorted.push_back(depth.at(y, x));
      std::ranges::sort(sorted);
      if (depth.valid(r, c)) {
        ASSERT_NEAR(value, (sorted[sorted.size() / 2] + sorted[(sorted.size() - 1) / 2]) / 2, 1e-6);
      }
    }
  }
}

/// Variance of the median of n (odd) standard normal values: its density n! / ((n-1)/2)!^2 (F (1 - F))^((n-1)/2) f
/// integrated over their range.
double variance_of_median(std::size_t n) {
  const double half = static_cast<double>(n / 2), step = 1e-3;
  const double factor = std::tgamma(static_cast<double>(n) + 1) / std::pow(std::tgamma(half + 1), 2);
  double variance = 0;
  for (double x = -9; x < 9; x += step) {
    const double below = std::erfc(-x / std::sqrt(2.0)) / 2, density = std::exp(-x * x / 2) / std::sqrt(2 * M_PI);
    variance += step * x * x * factor * std::pow(below * (1 - below), half) * density;
  }
  return variance;
}

/// The stage's documentation states an accuracy of 2 % of the variance, from one value to many.
TEST(Median, SigmaIsThatOfTheMedianOfNormalValues) {
  for (const std::size_t n : {1, 3, 5, 7, 9}) {
    std::vector<float> depth(9, NAN);
    for (std::size_t i = 0; i < n; ++i) depth[(i + 4) % 9] = 1;
    Harness stage("median");
    stage.put<float>("depth", {3, 3}, depth);
    stage.put<float>("sigma", {3, 3}, std::vector<float>(9, 0.010F), of_depth);
    stage.run();
    EXPECT_NEAR(stage.get<float>("sigma")[4] / 0.010, std::sqrt(variance_of_median(n)),
                0.01 * std::sqrt(variance_of_median(n)))
        << n;
  }
}

TEST(FlyingPixels, MarksThoseThatMixTheTwoSidesOfAnEdgeAndNoOthers) {
  const test::Scene scene = test::box_scene(size, 0);
  Image depth = scene.depth;
  std::vector<bool> mixed(depth.values.size());
  for (std::ptrdiff_t r = 1; r + 1 < depth.rows; ++r) {
    for (std::ptrdiff_t c = 1; c + 1 < depth.columns; ++c) {
      if (std::abs(scene.depth.at(r, c - 1) - scene.depth.at(r, c + 1)) < 0.2 ||
          mixed[static_cast<std::size_t>(r * depth.columns + c - 1)])
        continue;
      mixed[static_cast<std::size_t>(r * depth.columns + c)] = true;
      depth(r, c) = static_cast<float>(0.4 * scene.depth.at(r, c - 1) + 0.6 * scene.depth.at(r, c + 1));
    }
  }
  test::add_noise(depth, 0.002, 3);
  for (const bool invalidate : {false, true}) {
    Harness stage(std::string("flying_pixels invalidate=") + (invalidate ? "true" : "false"));
    stage.camera("camcube2");
    stage.put<float>("depth", {size, size}, depth.values);
    stage.put<float>("sigma", {size, size}, std::vector<float>(size * size, 0.002F), of_depth);
    stage.run();
    const auto flags = stage.get<std::uint16_t>("flags");
    const auto found = stage.get<float>("depth");
    std::size_t marked = 0;
    for (std::size_t i = 0; i < flags.size(); ++i) {
      ASSERT_EQ(flags[i], mixed[i] ? flag::mixed | (invalidate ? flag::invalid : 0) : 0)
          << i / size << ", " << i % size;
      ASSERT_EQ(std::isnan(found[i]), mixed[i] && invalidate);
      marked += mixed[i] ? 1 : 0;
    }
    EXPECT_GT(marked, 200U);
  }
}

/// Without sigma the limit follows from the noise of the frame itself; the fixed threshold alone marks many pixels of a
/// noisy image.
TEST(FlyingPixels, TakesTheNoiseFromTheFrameWhereSigmaIsMissing) {
  Image depth = test::box_scene(size, 0).depth;
  std::vector<bool> mixed(depth.values.size());
  const Image clean = depth;
  for (std::ptrdiff_t r = 1; r + 1 < depth.rows; ++r) {
    for (std::ptrdiff_t c = 1; c + 1 < depth.columns; ++c) {
      const auto i = static_cast<std::size_t>(r * depth.columns + c);
      if (std::abs(clean.at(r, c - 1) - clean.at(r, c + 1)) < 0.2 || mixed[i - 1]) continue;
      mixed[i] = true;
      depth(r, c) = static_cast<float>(0.5 * clean.at(r, c - 1) + 0.5 * clean.at(r, c + 1));
    }
  }
  test::add_noise(depth, 0.012, 5);
  const auto marked = [&](const std::string& line, bool with_sigma) {
    Harness stage(line);
    stage.camera("camcube2");
    stage.put<float>("depth", {size, size}, depth.values);
    if (with_sigma) stage.put<float>("sigma", {size, size}, std::vector<float>(size * size, 0.012F), of_depth);
    stage.run();
    std::size_t right = 0, wrong = 0;
    const auto flags = stage.get<std::uint16_t>("flags");
    for (std::size_t i = 0; i < flags.size(); ++i) {
      right += flags[i] != 0 && mixed[i] ? 1 : 0;
      wrong += flags[i] != 0 && !mixed[i] ? 1 : 0;
    }
    return std::pair{right, wrong};
  };
  const auto all = static_cast<std::size_t>(std::count(mixed.begin(), mixed.end(), true));
  const auto before = marked("flying_pixels deviations=0", false), own = marked("flying_pixels", false),
             known = marked("flying_pixels", true);
  std::printf("of %zu mixed pixels %zu, %zu, %zu marked; of %zu others %zu, %zu, %zu (no noise, own noise, sigma)\n",
              all, before.first, own.first, known.first, depth.values.size() - all, before.second, own.second,
              known.second);
  EXPECT_GT(before.second, depth.values.size() / 100);
  EXPECT_LT(own.second, depth.values.size() / 1000);
  EXPECT_GT(own.first, all * 95 / 100);
  EXPECT_NEAR(static_cast<double>(own.first), static_cast<double>(known.first), 0.05 * static_cast<double>(all));
}

/// Walls of boxes are seen at up to 80.1 degrees from their normal: they are surfaces, though steep.
TEST(FlyingPixels, LeavesSteepSurfacesAlone) {
  Image depth(size, size);
  for (std::ptrdiff_t r = 0; r < depth.rows; ++r)
    for (std::ptrdiff_t c = 0; c < depth.columns; ++c)
      depth(r, c) =
          static_cast<float>(1 / (1 - std::tan(70 * M_PI / 180) * (static_cast<double>(c) - 200) / 175.4 * 0.3));
  Harness stage("flying_pixels threshold='0 mm' deviations=0");
  stage.camera("camcube2");
  stage.put<float>("depth", {size, size}, depth.values);
  stage.run();
  for (const std::uint16_t bits : stage.get<std::uint16_t>("flags")) ASSERT_EQ(bits, 0);
}

std::vector<float> kalman(const std::string& line, const std::vector<float>& measured, std::vector<float>* sigma) {
  Harness stage(line);
  std::vector<float> filtered;
  for (const float value : measured) {
    stage.put<float>("depth", {1, 1}, {value});
    stage.run();
    filtered.push_back(stage.get<float>("depth")[0]);
    if (sigma != nullptr) sigma->push_back(stage.get<float>("sigma")[0]);
  }
  return filtered;
}

/// Without process noise the filter is the mean of all frames, with the standard deviation sigma / sqrt(n).
TEST(TemporalKalman, IsTheMeanOfWhatStandsStill) {
  Image values(1, 100);
  test::add_noise(values, 0.005, 4);
  for (float& value : values.values) value += 0.5F;  // lengths are positive
  std::vector<float> sigma;
  const auto filtered = kalman("temporal_kalman measurement_noise='5 mm' process_noise='0 mm'", values.values, &sigma);
  double sum = 0;
  for (std::size_t i = 0; i < 100; ++i) {
    sum += values.values[i];
    ASSERT_NEAR(filtered[i], sum / static_cast<double>(i + 1), 1e-7);
    ASSERT_NEAR(sigma[i], 0.005 / std::sqrt(static_cast<double>(i + 1)), 1e-7);
  }
}

/// With it, the standard deviation converges to q + P - (q + P)^2 / (q + P + r) = P: P = q (sqrt(1 + 4 r / q) - 1) / 2.
TEST(TemporalKalman, SettlesAtTheRiccatiEquationsSolution) {
  std::vector<float> sigma;
  kalman("temporal_kalman measurement_noise='5 mm' process_noise='1 mm'", std::vector<float>(200, 1.0F), &sigma);
  const double q = 1e-6, r = 25e-6;
  EXPECT_NEAR(sigma.back(), std::sqrt(q * (std::sqrt(1 + 4 * r / q) - 1) / 2), 1e-8);
}

TEST(TemporalKalman, FollowsJumpsAtOnceAndDriftsSoon) {
  const std::string line = "temporal_kalman measurement_noise='5 mm'";
  std::vector<float> jump(20, 1.0F);
  jump.insert(jump.end(), {1.05F, NAN, 1.2F});
  const auto followed = kalman(line, jump, nullptr);
  EXPECT_EQ(followed[20], 1.05F);
  EXPECT_TRUE(std::isnan(followed[21]));
  EXPECT_EQ(followed[22], 1.2F);
  std::vector<float> drift;
  for (int i = 0; i < 200; ++i) drift.push_back(1 + 0.003F * static_cast<float>(i));
  const auto behind = kalman(line, drift, nullptr);
  for (std::size_t i = 0; i < drift.size(); ++i) EXPECT_LT(std::abs(behind[i] - drift[i]), 0.020F) << i;
}

TEST(TemporalKalman, SaysThatItNeedsTheNoise) {
  try {
    kalman("temporal_kalman", {1.0F}, nullptr);
    FAIL();
  } catch (const std::exception& error) {
    EXPECT_NE(std::string(error.what()).find("give it, e.g. measurement_noise: 5 mm"), std::string::npos);
  }
}

}  // namespace
}  // namespace tofgraph
