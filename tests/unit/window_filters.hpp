// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file For tests of the filters that average over a window: random images, and the filter output of a stage.
#pragma once

#include <gtest/gtest.h>
#include <tofgraph/harness.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "tests/unit/denoise_reference.hpp"

namespace test {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

inline std::vector<std::uint64_t> extent(const Image& image) {
  return {static_cast<std::uint64_t>(image.rows), static_cast<std::uint64_t>(image.columns)};
}

struct Result {
  std::vector<float> depth, sigma;
  std::vector<std::uint16_t> flags;
};

inline Result run(const std::string& line, const Image& depth, const Image* sigma = nullptr) {
  tofgraph::Harness stage(line);
  stage.put<float>("depth", extent(depth), depth.values);
  if (sigma != nullptr)
    stage.put<float>("sigma", extent(*sigma), sigma->values, {.unit = "m", .of = "depth", .applied = "", .from = ""});
  stage.run();
  return {stage.get<float>("depth"), sigma != nullptr ? stage.get<float>("sigma") : std::vector<float>(),
          stage.get<std::uint16_t>("flags")};
}

/// Steps, slopes and noise, by default with 5 % of the pixels invalid.
inline Image random_image(std::ptrdiff_t rows, std::ptrdiff_t columns, unsigned seed, double invalid = 0.05) {
  Image image(rows, columns);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> level(0.4F, 7.0F);
  for (std::ptrdiff_t r = 0; r < rows; r += 11) {
    for (std::ptrdiff_t c = 0; c < columns; c += 13) {
      const float height = level(random);
      for (std::ptrdiff_t y = r; y < std::min(r + 11, rows); ++y)
        for (std::ptrdiff_t x = c; x < std::min(c + 13, columns); ++x)
          image(y, x) = height + 0.003F * static_cast<float>(x - c);
    }
  }
  add_noise(image, 0.010, seed);
  drop_pixels(image, invalid, seed + 1);
  return image;
}

/// Random sigma of 5 to 20 mm.
inline Image random_sigma(const Image& like, unsigned seed) {
  Image sigma(like.rows, like.columns);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> level(0.005F, 0.020F);
  for (std::size_t i = 0; i < sigma.values.size(); ++i)
    sigma.values[i] = std::isnan(like.values[i]) ? nan : level(random);
  return sigma;
}

inline void expect_near(const std::vector<float>& found, const std::vector<double>& expected, double tolerance,
                        const std::string& what) {
  ASSERT_EQ(found.size(), expected.size());
  double most = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    ASSERT_EQ(std::isnan(found[i]), std::isnan(expected[i])) << what << ", pixel " << i;
    if (!std::isnan(expected[i])) most = std::max(most, std::abs(static_cast<double>(found[i]) - expected[i]));
  }
  EXPECT_LE(most, tolerance) << what;
}

}  // namespace test
