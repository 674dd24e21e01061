// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Random pixel patterns of effects, of which only the spread is known.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "simulation/frames.hpp"
#include "tests/unit/effect_fixture.hpp"

using namespace tofgraph;
using namespace tofgraph::test;

namespace {

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double deviation_of(const std::vector<double>& values) {
  const double mean = mean_of(values);
  double sum = 0;
  for (const double v : values) sum += (v - mean) * (v - mean);
  return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

/// Correlation of neighbours in a row.
double correlation(const std::vector<double>& values) {
  const double mean = mean_of(values);
  double product = 0, square = 0;
  for (std::size_t i = 0; i + 1 < values.size(); ++i) {
    product += (values[i] - mean) * (values[i + 1] - mean);
    square += (values[i] - mean) * (values[i] - mean);
  }
  return product / square;
}

View whole_view() {
  View view;
  view.pixels = whole_image(camcube());
  view.board = {2, 0, 0, 0.6};
  return view;
}

/// Change of the distance of each pixel caused by an effect, m.
std::vector<double> offsets_of(const std::string& list, const View& view) {
  const auto ideal = seen("", view), real = seen(list, view);
  std::vector<double> result;
  for (std::size_t i = 0; i < ideal.size(); ++i) result.push_back(turned(real[i], ideal[i]) * metres_per_radian);
  return result;
}

TEST(DrawnPattern, OfTheDistanceHasItsSpread) {
  const auto offsets = offsets_of("{effect: fixed_pattern, scale: 1, spread: 4 mm}", whole_view());
  const double count = static_cast<double>(offsets.size());  // 41616: the standard deviation is known to 0.35 %
  EXPECT_NEAR(mean_of(offsets), 0, 4 * 4e-3 / std::sqrt(count));
  EXPECT_NEAR(deviation_of(offsets), 4e-3, 4 * 4e-3 / std::sqrt(2 * count));
  EXPECT_NEAR(correlation(offsets), 0, 4 / std::sqrt(count));
  EXPECT_LT(*std::ranges::max_element(offsets), 6 * 4e-3);
}

TEST(DrawnPattern, IsThatOfItsSeedAndScale) {
  const View view = whole_view();
  const auto one = offsets_of("{effect: fixed_pattern, scale: 1, spread: 4 mm}", view);
  EXPECT_EQ(offsets_of("{effect: fixed_pattern, scale: 1, spread: 4 mm, seed: 1}", view), one);
  View farther = view;
  farther.board.distance = 3;
  const auto there = offsets_of("{effect: fixed_pattern, scale: 1, spread: 4 mm}", farther);
  const auto twice = offsets_of("{effect: fixed_pattern, scale: 2, spread: 4 mm}", view);
  const auto other = offsets_of("{effect: fixed_pattern, scale: 1, spread: 4 mm, seed: 2}", view);
  const auto off = offsets_of("{effect: fixed_pattern, spread: 4 mm}", view);
  double product = 0;
  for (std::size_t i = 0; i < one.size(); ++i) {
    ASSERT_NEAR(there[i], one[i], 1e-12);
    ASSERT_NEAR(twice[i], 2 * one[i], 1e-12);
    ASSERT_EQ(off[i], 0);
    product += one[i] * other[i] / (4e-3 * 4e-3);
  }
  EXPECT_NEAR(product / static_cast<double>(one.size()), 0, 4 / std::sqrt(static_cast<double>(one.size())));
}

TEST(DrawnPattern, IsIndependentOfTheNoiseOfFramesWithTheSameSeed) {
  const View view = whole_view();
  const auto offsets = offsets_of("{effect: fixed_pattern, scale: 1, spread: 4 mm, seed: 1}", view);
  const ForwardModel model(camcube(), view.physical, {});
  const Tracer board = board_tracer(camcube().focal_length, view.board);
  const std::size_t n = offsets.size();
  std::vector<float> clean(4 * n), noisy(4 * n);
  Frames(model, board, view.acquisition, view.pixels, {}, {}).phases(0, clean.data());
  Frames(model, board, view.acquisition, view.pixels, {3, 0}, {1, 0}).phases(0, noisy.data());
  for (std::size_t k = 0; k < 4; ++k) {
    double product = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double noise = static_cast<double>(noisy[k * n + i]) - static_cast<double>(clean[k * n + i]);
      product += offsets[i] / 4e-3 * noise / (3 * std::sqrt(2.0));
    }
    EXPECT_NEAR(product / static_cast<double>(n), 0, 4 / std::sqrt(static_cast<double>(n))) << "image " << k;
  }
}

TEST(DrawnPattern, AveragesOutWherePointsStandForManyPixels) {
  View view = whole_view();
  view.pixels = superpixels(camcube(), 12, 12);
  const std::string both = "{effect: fixed_pattern, scale: 1, spread: 4 mm}, {effect: crosstalk, spread: 500 counts/s}";
  for (const double offset : offsets_of(both, view)) EXPECT_EQ(offset, 0);
}

TEST(DrawnPattern, OfCrosstalkGrowsWithTheTimeAndSpreadsBothParts) {
  View view = whole_view();
  for (const double time : {1e-3, 4e-3}) {
    view.acquisition.condition.integration_time = time;
    const auto ideal = seen("", view),
               real = seen("{effect: crosstalk, real: 300 counts/s, imaginary: -200 counts/s, spread: 500 counts/s}",
                           view);
    std::vector<double> across, along;
    double product = 0;
    for (std::size_t i = 0; i < ideal.size(); ++i) {
      const Complex added = real[i].phasor() - ideal[i].phasor();
      across.push_back(added.real() / time);
      along.push_back(added.imag() / time);
      EXPECT_NEAR(real[i].light() - ideal[i].light(), std::abs(added) / (2 * 0.5), 1e-6) << "its light counts";
    }
    const double count = static_cast<double>(across.size()), sure = 4 / std::sqrt(count);
    EXPECT_NEAR(mean_of(across), 300, 500 * sure);
    EXPECT_NEAR(mean_of(along), -200, 500 * sure);
    EXPECT_NEAR(deviation_of(across), 500, 500 * sure);
    EXPECT_NEAR(deviation_of(along), 500, 500 * sure);
    for (std::size_t i = 0; i < across.size(); ++i) product += (across[i] - 300) * (along[i] + 200) / 250000;
    EXPECT_NEAR(product / count, 0, sure);
  }
}

}  // namespace
