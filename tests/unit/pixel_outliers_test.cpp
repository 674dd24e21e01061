// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Pixels unlike their neighbours: which are rejected, and the false positive rate.
#include "calibration/pixel_outliers.hpp"

#include <tofgraph/physics/to_integer.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>

namespace tofgraph::tests {
namespace {

using namespace calibration;

constexpr std::size_t side = 100;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// A window of a flat target with noise, darker towards the corners.
struct Target {
  std::vector<std::size_t> pixels = std::vector<std::size_t>(side * side);
  std::vector<double> residual, amplitude, variance;

  explicit Target(unsigned seed, std::size_t frames = 4) {
    std::iota(pixels.begin(), pixels.end(), std::size_t{0});
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    for (const std::size_t i : pixels) {
      const double u = static_cast<double>(i % side) / side - 0.5, v = static_cast<double>(i / side) / side - 0.5;
      const double light = 1000 / std::pow(1 + 3 * (u * u + v * v), 2), sd = 10 / light;  // m
      double sum = 0, squares = 0;
      for (std::size_t f = 0; f < frames; ++f) {
        const double d = sd * normal(random);
        sum += d;
        squares += d * d;
      }
      const auto n = static_cast<double>(frames);
      residual.push_back(0.03 + 0.02 * u + sum / n);
      amplitude.push_back(light);
      variance.push_back((squares - sum * sum / n) / (n - 1));
    }
  }
  FlatTarget view(std::size_t frames = 4) const {
    return {.pixels = pixels,
            .residual = residual,
            .amplitude = amplitude,
            .variance = variance,
            .freedom = static_cast<double>(frames - 1),
            .range = 7.5,
            .columns = side};
  }
};

TEST(PixelOutliers, GoodPixelsAreKept) {
  std::size_t rejected = 0;
  for (unsigned seed = 0; seed < 5; ++seed) {
    UnusablePixels counts;
    const Target target(seed);
    keep_like_neighbours(target.view(), counts);
    rejected += counts.total();
  }
  EXPECT_LE(rejected, 1U) << "of 50000, limits of 6 standard deviations";
}

TEST(PixelOutliers, EachReasonIsCountedOnce) {
  Target target(1);
  target.amplitude[205] = 3;
  target.amplitude[305] = nan;  // unknown: kept
  target.variance[5000] *= 400;
  target.residual[7050] += 0.5;
  target.residual[7070] += 7.5 - 0.02;  // equal up to one wrap: within the noise
  target.residual[0] -= 0.4;            // in the corner
  UnusablePixels counts;
  const std::vector<std::uint8_t> keep = keep_like_neighbours(target.view(), counts);
  EXPECT_EQ(counts.amplitude, 1U);
  EXPECT_EQ(counts.noisy, 1U);
  EXPECT_EQ(counts.distance, 2U);
  for (const std::size_t i : {205U, 5000U, 7050U, 0U}) EXPECT_EQ(keep[i], 0) << i;
  for (const std::size_t i : {206U, 305U, 7070U, 1U}) EXPECT_EQ(keep[i], 1) << i;
  EXPECT_NE(counts.described().find("1 noisier than their neighbours"), std::string::npos);
}

TEST(PixelOutliers, AThirdOfThePixelsMayBeDead) {
  Target target(2);
  std::mt19937_64 random(4);
  std::bernoulli_distribution third(0.3);
  std::vector<bool> dead(target.pixels.size());
  for (std::size_t i = 0; i < dead.size(); ++i) {
    dead[i] = third(random);
    if (!dead[i]) continue;
    target.amplitude[i] = 3;
    target.residual[i] = std::uniform_real_distribution<double>(-3, 3)(random);
  }
  UnusablePixels counts;
  const std::vector<std::uint8_t> keep = keep_like_neighbours(target.view(), counts);
  std::size_t missed = 0;
  for (std::size_t i = 0; i < dead.size(); ++i) missed += dead[i] && keep[i] != 0 ? 1 : 0;
  EXPECT_LE(missed, 3U) << "of 3000: in corners with more than six dead neighbours out of eight";
}

TEST(PixelOutliers, TheQuantileIsThatOfChiSquare) {
  // Wilson-Hilferty approximation: tail probabilities are accurate to 20 %, verified by simulation.
  std::mt19937_64 random(9);
  for (const double freedom : {4.0, 30.0}) {
    std::chi_squared_distribution<double> chi(freedom);
    double above = 0, below = 0;
    constexpr int draws = 1000000;
    for (int i = 0; i < draws; ++i) {
      const double ratio = chi(random) / freedom;
      above += ratio > variance_ratio_at(freedom, 3) ? 1.0 / draws : 0;
      below += ratio < variance_ratio_at(freedom, -2) ? 1.0 / draws : 0;
    }
    EXPECT_NEAR(above, 0.00135, 0.2 * 0.00135) << freedom;
    EXPECT_NEAR(below, 0.02275, 0.2 * 0.02275) << freedom;
  }
  // Far out, where the limits are, the exact probability for 4 is e^(-x/2) (1 + x/2): at most that of 6 deviations.
  const double half = 4 * variance_ratio_at(4, outlier_deviate) / 2;
  EXPECT_LT(std::exp(-half) * (1 + half), 1e-9);
}

TEST(PixelOutliers, IsolatedPixelsOfAPatternAreMarkedAndItsEdgesAreNot) {
  std::vector<double> image(side * side);
  for (std::size_t i = 0; i < image.size(); ++i)  // a chessboard of 7 px with hard edges
    image[i] = (i % side / 7 + i / side / 7) % 2 == 0 ? 1000 : 100;
  std::vector<double> clean = image;
  EXPECT_EQ(mark_isolated(clean, side, 5), 0U);
  image[20 * side + 24] = 2;      // within a bright square
  image[51 * side + 10] = 60000;  // within a dark one
  EXPECT_EQ(mark_isolated(image, side, 5), 2U);
  EXPECT_TRUE(std::isnan(image[20 * side + 24]));
  EXPECT_TRUE(std::isnan(image[51 * side + 10]));
}

TEST(ToInteger, EveryValueHasAResult) {
  using physics::to_integer;
  EXPECT_EQ(to_integer(2.5, 0), 3);
  EXPECT_EQ(to_integer(-2.5, 0), -3);
  EXPECT_EQ(to_integer(nan, -7), -7);
  EXPECT_EQ(to_integer(HUGE_VAL, 0L), std::numeric_limits<long>::max());
  EXPECT_EQ(to_integer(-HUGE_VAL, 0L), std::numeric_limits<long>::min());
  EXPECT_EQ(to_integer(9.3e18, 0L), std::numeric_limits<long>::max());
  EXPECT_EQ(to_integer(-1.0, std::uint16_t{5}), 0);
  EXPECT_EQ(to_integer(70000.0, std::uint16_t{5}), 65535);
}

}  // namespace
}  // namespace tofgraph::tests
