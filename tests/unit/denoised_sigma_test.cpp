// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: DenoisedSigma.IsNever*
// Rooms: plugins
// The sigma stated by denoisers, compared with the standard deviation of their results, by Monte Carlo: tall boards
// whose columns are thousands of repetitions of the same neighbourhood.
#include <gtest/gtest.h>
#include <tofgraph/harness.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/window_filters.hpp"

namespace tofgraph {
namespace {

constexpr std::size_t rows = 3000, columns = 40, border = 10;  // border: rows excluded at the top and at the bottom

/// A board as a function of the column: slope along the rows and 0.3 of it across them, a depth step and different
/// noise from the middle column on.
struct Board {
  double slope = 0;                           // m per pixel
  double step = 0;                            // m
  double sigma = 0.010, other_sigma = 0.010;  // m

  double depth(std::size_t r, std::size_t c) const {
    const double along = static_cast<double>(c) - columns / 2.0, across = static_cast<double>(r) - rows / 2.0;
    return 20 + slope * (along + 0.3 * across) + (c < columns / 2 ? 0 : step);
  }
  double noise(std::size_t c) const { return c < columns / 2 ? sigma : other_sigma; }
};

constexpr double relative = 4 * M_PI * 20e6 / 299792458;  // relative standard deviation of the amplitude per metre

/// Ratio of stated to actual standard deviation, and the actual variance, of each column.
struct Column {
  double stated = 0, real = 0;  // m^2
};

std::vector<Column> columns_of(const std::string& line, const Board& board) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise;
  std::vector<float> depth, amplitude, sigma;
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t c = 0; c < columns; ++c) {
      depth.push_back(static_cast<float>(board.depth(r, c) + board.noise(c) * noise(random)));
      amplitude.push_back(static_cast<float>(10 / board.noise(c) * (1 + relative * board.noise(c) * noise(random))));
      sigma.push_back(static_cast<float>(board.noise(c)));
    }
  }
  Harness stage(line);
  stage.put<float>("depth", {rows, columns}, depth);
  stage.put<float>("amplitude", {rows, columns}, amplitude);
  stage.put<float>("sigma", {rows, columns}, sigma, {.unit = "m", .of = "depth", .applied = "", .from = ""});
  stage.metadata().modulation_frequency = 20e6;
  stage.run();
  const auto found = stage.get<float>("depth"), stated = stage.get<float>("sigma");
  std::vector<Column> result(columns);
  constexpr double n = rows - 2 * border;
  for (std::size_t c = 0; c < columns; ++c) {
    double mean = 0, squares = 0;
    for (std::size_t r = border; r < rows - border; ++r) {
      const std::size_t i = r * columns + c;
      const double error = static_cast<double>(found[i]) - board.depth(r, c);
      mean += error / n;
      squares += error * error / n;
      result[c].stated += std::pow(static_cast<double>(stated[i]), 2) / n;
    }
    result[c].real = squares - mean * mean;
  }
  return result;
}

/// Ratio of stated to actual standard deviation, root mean square over the columns [first, last).
double ratio(const std::vector<Column>& found, std::size_t first, std::size_t last) {
  Column sum;
  for (std::size_t c = first; c < last; ++c) sum.stated += found[c].stated, sum.real += found[c].real;
  return std::sqrt(sum.stated / sum.real);
}

const std::vector<std::string> pixel_filters = {"bilateral",
                                                "bilateral rho='1.5 px' window=5",
                                                "bilateral strength='5 mm' window=11",
                                                "bilateral strength='50 mm'",
                                                "yaroslavsky",
                                                "yaroslavsky strength='20 mm' window=5",
                                                "yaroslavsky sigma_adaptive=true",
                                                "yaroslavsky strength='7 mm'",
                                                "median",
                                                "median window=5"};
const std::vector<std::string> patch_filters = {"non_local_means",
                                                "non_local_means sigma_adaptive=true",
                                                "non_local_means strength='20 mm'",
                                                "non_local_means strength='8 mm'",
                                                "non_local_means strength='50 mm'",
                                                "non_local_means patch=1",
                                                "non_local_means patch=5 search=9",
                                                "non_local_means patch_weights=uniform",
                                                "non_local_means patch_weights=uniform patch=5 search=5",
                                                "non_local_means guide=amplitude",
                                                "non_local_means patch_weights=robust",
                                                "non_local_means patch_weights=robust guide=amplitude strength='20 mm'",
                                                "non_local_means patch_weights=robust patch=5 sigma_adaptive=true"};

/// The smallest and the largest ratio of a test, printed at its end.
struct Extremes {
  std::string what;
  double least = INFINITY, greatest = 0;

  explicit Extremes(std::string name) : what(std::move(name)) {}
  double seen(double value) {
    least = std::min(least, value), greatest = std::max(greatest, value);
    return value;
  }
  ~Extremes() { std::printf("%s: stated over real %.3f to %.3f\n", what.c_str(), least, greatest); }
};

void expect_right(const std::vector<std::string>& lines, const Board& board, const std::string& what) {
  Extremes extremes(what);
  for (const std::string& line : lines)
    EXPECT_NEAR(extremes.seen(ratio(columns_of(line, board), 0, columns)), 1, 0.1) << line << ", " << what;
}

TEST(DenoisedSigma, IsTheSpreadOnFlatBoards) {
  expect_right(pixel_filters, {}, "pixels, flat");
  expect_right(patch_filters, {}, "patches, flat");
}

TEST(DenoisedSigma, IsTheSpreadOnSlopes) {
  for (const double slope : {0.003, 0.010}) {
    expect_right(pixel_filters, {.slope = slope}, "pixels, slope " + std::to_string(slope));
    expect_right(patch_filters, {.slope = slope}, "patches, slope " + std::to_string(slope));
  }
}

/// Each half alone, also where 5 mm and 15 mm meet.
TEST(DenoisedSigma, IsTheSpreadWhereTwoAmplitudesMeet) {
  Extremes extremes("two amplitudes");
  for (const auto* lines : {&pixel_filters, &patch_filters}) {
    for (const std::string& line : *lines) {
      const auto found = columns_of(line, {.sigma = 0.005, .other_sigma = 0.015});
      EXPECT_NEAR(extremes.seen(ratio(found, 4, 14)), 1, 0.1) << line << ", 5 mm";
      EXPECT_NEAR(extremes.seen(ratio(found, 14, 20)), 1, 0.1) << line << ", 5 mm beside 15 mm";
      EXPECT_NEAR(extremes.seen(ratio(found, 20, 26)), 1, 0.1) << line << ", 15 mm beside 5 mm";
      EXPECT_NEAR(extremes.seen(ratio(found, 26, 36)), 1, 0.1) << line << ", 15 mm";
    }
  }
}

TEST(DenoisedSigma, IsNeverFarBelowTheSpreadAtEdges) {
  for (const double step : {0.015, 0.030, 0.200}) {
    Extremes extremes("edge " + std::to_string(step));
    for (const auto* lines : {&pixel_filters, &patch_filters}) {
      for (const std::string& line : *lines) {
        const auto found = columns_of(line, {.step = step});
        for (std::size_t c = 10; c < 30; ++c)
          EXPECT_GT(extremes.seen(ratio(found, c, c + 1)), 0.7) << line << ", step " << step << ", column " << c;
      }
    }
  }
}

}  // namespace
}  // namespace tofgraph
