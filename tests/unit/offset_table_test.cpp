// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Interpolation between boards, compared with closed forms.
#include <gtest/gtest.h>
#include <tofgraph/physics/interpolation.hpp>
#include <tofgraph/physics/non_linearity.hpp>
#include <tofgraph/physics/offset_table.hpp>

#include <cmath>
#include <random>

#include "tests/unit/exhaustive_offset.hpp"

namespace tofgraph::physics {
namespace {

TEST(MonotoneCurve, IsTheFormulaOfFritschAndButland) {
  // Secants 1 and 1/2 over steps 1 and 2: the slope at 1 is (5 + 4) / (5 / 1 + 4 / 0.5) = 9/13.
  const MonotoneCurve curve({0, 1, 3}, {0, 1, 2});
  EXPECT_DOUBLE_EQ(curve(0.5), 0.5 * 0.25 + 0.25 * (2 - 0.5 * 9 / 13.0));
  EXPECT_EQ(curve(1), 1);
  EXPECT_NEAR((curve(1 + 1e-6) - curve(1 - 1e-6)) / 2e-6, 9 / 13.0, 1e-6) << "no kink";
  EXPECT_DOUBLE_EQ(curve(5), 3) << "straight beyond its ends";
  EXPECT_DOUBLE_EQ(curve(-2), -2);
}

TEST(MonotoneCurve, RisesWhereItsPointsRiseAndKeepsLines) {
  const MonotoneCurve steep({0, 1, 2, 2.1, 4}, {0, 0.01, 0.02, 5, 5.001}), line({1, 4, 5, 9}, {2, 8, 10, 18});
  double before = -1;
  for (double x = 0; x <= 4; x += 0.001) {
    ASSERT_GE(steep(x), before) << x;
    before = steep(x);
  }
  for (double x = -1; x <= 11; x += 0.37) EXPECT_NEAR(line(x), 2 * x, 1e-12);
}

TEST(MonotoneCurve, RefusesPointsThatDoNotRise) {
  EXPECT_THROW(MonotoneCurve({0, 0}, {1, 2}), std::invalid_argument);
  EXPECT_THROW(MonotoneCurve({}, {}), std::invalid_argument);
}

/// True value for a measurement at z: linear in z, ln reflectivity and ln time.
double truth(double z, double reflectivity, double time) {
  return 1.01 * z + 5e-3 * std::log(reflectivity) - 3e-3 * std::log(time / 1e-3);
}

std::vector<OffsetSample> grid(std::size_t every = 1) {
  std::vector<OffsetSample> samples;
  const double reflectivities[] = {0.8, 0.3, 0.1};
  std::size_t number = 0;
  for (std::size_t target = 0; target < 3; ++target) {
    for (double z = 0.5; z < 3.1; z += 0.5) {
      for (const double time : {1e-3, 2e-3, 8e-3}) {
        if (number++ % every == 0)
          samples.push_back({target, truth(z, reflectivities[target], time), z, time, reflectivities[target]});
      }
    }
  }
  return samples;
}

TEST(OffsetTable, AGridGivesWhatIsLinearExactly) {
  // Distances differ between times and targets here, as real measurements do: boards are grouped by labels alone.
  std::vector<OffsetSample> samples = grid();
  for (OffsetSample& s : samples) {
    const double z = s.depth;
    s.depth = s.distance;  // truth and measurement exchanged: the distances of the boards are equal
    s.distance = z;
  }
  const OffsetTable table(samples);
  ASSERT_EQ(table.shape(), OffsetTable::Shape::grid);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(0, 1);
  for (int i = 0; i < 200; ++i) {
    const double z = 0.6 + 2.3 * any(random), time = 1e-3 * std::pow(8, any(random)),
                 reflectivity = 0.1 * std::pow(8, any(random));
    const double expected = (z - 5e-3 * std::log(reflectivity) + 3e-3 * std::log(time / 1e-3)) / 1.01;
    const auto found = table.across(z, time).at(reflectivity);
    EXPECT_NEAR(found.depth, expected, 1e-9);
    EXPECT_FALSE(found.extrapolated);
  }
}

TEST(OffsetTable, SaysWhatIsBeyondTheSamples) {
  std::vector<OffsetSample> samples = grid();
  for (OffsetSample& s : samples) std::swap(s.depth, s.distance);
  const OffsetTable table(samples);
  EXPECT_FALSE(table.across(2, 2e-3).at(0.85).extrapolated) << "noise of the brightest board";
  EXPECT_TRUE(table.across(2, 2e-3).at(1.2).extrapolated);
  EXPECT_TRUE(table.across(2, 2e-3).at(0.05).extrapolated);
  EXPECT_TRUE(table.across(0.4, 2e-3).at(0.3).extrapolated);
  EXPECT_TRUE(table.across(4, 2e-3).at(0.3).extrapolated);
  EXPECT_TRUE(table.across(2, 12e-3).at(0.3).extrapolated);
  // The error of the last board is extrapolated as a constant.
  EXPECT_NEAR(table.across(5, 2e-3).at(0.3).depth - 5, table.across(4, 2e-3).at(0.3).depth - 4, 1e-12);
}

TEST(OffsetTable, AnEmptyCellIsFilledFromTheOtherTimes) {
  std::vector<OffsetSample> samples = grid();
  for (OffsetSample& s : samples) std::swap(s.depth, s.distance);
  std::erase_if(samples, [](const OffsetSample& s) { return s.integration_time == 2e-3 && s.distance > 2.9; });
  const OffsetTable table(samples);
  ASSERT_EQ(table.shape(), OffsetTable::Shape::grid);
  EXPECT_NEAR(table.across(3, 2e-3).at(0.3).depth, (3 - 5e-3 * std::log(0.3) + 3e-3 * std::log(2)) / 1.01, 1e-9);
}

TEST(OffsetTable, ScatteredSamplesAreMetExactlyAndNearInBetween) {
  std::vector<OffsetSample> samples;
  std::mt19937 random(2);
  std::uniform_real_distribution<double> any(0, 1);
  for (int i = 0; i < 300; ++i) {
    const double z = 0.5 + 3 * any(random), time = 1e-3 * std::pow(8, any(random)),
                 rho = 0.1 * std::pow(8, any(random));
    // A few boards at the same position at several times: neither grid nor sheet.
    samples.push_back({0, truth(z, rho, time), z, time, rho});
    if (i % 100 == 0) samples.push_back({0, truth(z, rho, time), z + 1e-4, time * 1.1, rho});
  }
  const OffsetTable table(samples);
  ASSERT_EQ(table.shape(), OffsetTable::Shape::scattered);
  for (const OffsetSample& s : samples)
    ASSERT_NEAR(table.across(s.depth, s.integration_time).at(s.reflectivity).depth, s.distance, 1e-6);
  for (int i = 0; i < 50; ++i) {
    const double z = 0.7 + 2.5 * any(random), time = 2e-3, rho = 0.3;
    EXPECT_NEAR(table.across(z, time).at(rho).depth, truth(z, rho, time), 3e-3);
  }
}

TEST(OffsetTable, TheNearestOfThousandsOfScatteredSamplesAreFound) {
  std::vector<OffsetSample> samples;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(0, 1);
  for (int i = 0; i < 5000; ++i) {
    const double z = 0.5 + 3 * any(random), time = 1e-3 * std::pow(8, any(random)),
                 rho = 0.1 * std::pow(8, any(random));
    samples.push_back({0, truth(z, rho, time), z, time, rho});
    if (i == 0) samples.push_back({0, truth(z, rho, time), z + 1e-4, time * 1.1, rho});
  }
  const OffsetTable table(samples);
  ASSERT_EQ(table.shape(), OffsetTable::Shape::scattered);
  for (int i = 0; i < 300; ++i) {
    const double z = 0.5 + 3 * any(random), time = 1e-3 * std::pow(8, any(random)),
                 rho = 0.1 * std::pow(8, any(random));
    EXPECT_NEAR(table.across(z, time).at(rho).depth, z + tests::exhaustive_errors(samples, z, rho, time).first, 1e-9);
  }
}

TEST(OffsetTable, ADepthThatBelongsToTwoDistancesIsRefused) {
  EXPECT_THROW(OffsetTable({{0, 1, 1.2, 1e-3, 0.5}, {0, 1.25, 1.19, 1e-3, 0.5}}), std::invalid_argument);
}

TEST(NonLinearity, NewtonFindsWhatBisectionFinds) {
  const Geometry geometry{12.8e-3, {{{-0.05, 0, 0}, 0.3}, {{0.05, 0.02, 0.01}, 0.7}}};
  for (double x = -0.35; x < 0.36; x += 0.07) {
    const double length = std::sqrt(x * x + 0.04 + 1);
    const Vector3 ray{x / length, 0.2 / length, 1 / length};
    for (double distance = 0.08; distance < 8; distance *= 1.3) {
      const double slow = optimized_bistatic_bisection(geometry, ray, distance);
      EXPECT_NEAR(optimized_bistatic_newton(geometry, ray, distance), slow, 1e-13 * (1 + distance)) << distance;
    }
    EXPECT_TRUE(std::isnan(optimized_bistatic_newton(geometry, ray, 0.01)));
  }
}

}  // namespace
}  // namespace tofgraph::physics
