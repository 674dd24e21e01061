// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Compared with brute force: all distances, sorted.
#include <tofgraph/harness.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace tofgraph {
namespace {

constexpr std::size_t rows = 20, columns = 30, pixels = rows * columns, neighbours = 8;
constexpr double deviations = 1.5;

std::vector<float> wall_with_outliers() {
  std::mt19937 random(11);
  std::normal_distribution<float> noise(0, 0.003F);
  std::vector<float> points;
  for (std::size_t i = 0; i < pixels; ++i) {
    const bool out = i % 37 == 5, invalid = i % 41 == 7;
    points.push_back(invalid ? NAN : 0.02F * static_cast<float>(i % columns) + noise(random));
    points.push_back(invalid ? NAN : 0.02F * static_cast<float>(i / columns) + noise(random));
    points.push_back(invalid ? NAN : 2 + noise(random) + (out ? 0.1F * static_cast<float>(i % 5 + 1) : 0));
  }
  return points;
}

/// Mean distance of each valid point to its nearest neighbours; NaN for the others.
std::vector<double> mean_distances(const std::vector<float>& points) {
  std::vector<double> means(pixels, NAN);
  for (std::size_t i = 0; i < pixels; ++i) {
    if (std::isnan(points[3 * i])) continue;
    std::vector<double> all;
    for (std::size_t j = 0; j < pixels; ++j) {
      if (j == i || std::isnan(points[3 * j])) continue;
      double square = 0;
      for (std::size_t k = 0; k < 3; ++k)
        square += std::pow(static_cast<double>(points[3 * i + k]) - points[3 * j + k], 2);
      all.push_back(std::sqrt(square));
    }
    std::ranges::sort(all);
    means[i] = 0;
    for (std::size_t j = 0; j < neighbours; ++j) means[i] += all[j] / neighbours;
  }
  return means;
}

TEST(StatisticalOutlierRemoval, MarksWhatIsFarFromItsNeighbours) {
  const auto points = wall_with_outliers();
  Harness stage("statistical_outlier_removal neighbours=8 deviations=1.5");
  stage.put<float>("points", {rows, columns, 3}, points);
  stage.put<float>("depth", {rows, columns}, std::vector<float>(pixels, 1.0F));
  stage.run();
  const auto means = mean_distances(points);
  double sum = 0, squares = 0, n = 0;
  for (const double mean : means) {
    if (std::isnan(mean)) continue;
    sum += mean;
    squares += mean * mean;
    ++n;
  }
  const double limit = sum / n + deviations * std::sqrt((squares - sum * sum / n) / (n - 1));
  const auto kept = stage.get<float>("points"), depth = stage.get<float>("depth");
  const auto flags = stage.get<std::uint16_t>("flags");
  std::size_t removed = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const bool out = means[i] > limit;
    removed += out ? 1 : 0;
    EXPECT_EQ(flags[i], out ? 129 : 0) << i;
    EXPECT_EQ(std::isnan(kept[3 * i + 2]), out || std::isnan(points[3 * i])) << i;
    EXPECT_EQ(std::isnan(depth[i]), out) << i;
  }
  EXPECT_GT(removed, 5U);
  EXPECT_EQ(stage.extent("points"), (std::vector<std::uint64_t>{rows, columns, 3}));
}

TEST(StatisticalOutlierRemoval, LeavesCloudsOfFewPointsAlone) {
  Harness stage("statistical_outlier_removal");
  stage.put<float>("points", {1, 3, 3}, {0, 0, 1, 0, 0, 2, NAN, NAN, NAN});
  stage.run();
  EXPECT_EQ(stage.get<std::uint16_t>("flags"), (std::vector<std::uint16_t>{0, 0, 0}));
}

}  // namespace
}  // namespace tofgraph
