// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: WindowFilters.NonLocal*
// Rooms: plugins
// The filters with weights exp(-d^2 / h^2) over a window, compared with their equations in double precision, on every
// instruction set of this machine.
#include <tofgraph/harness.hpp>

#include <gtest/gtest.h>

#include "tests/unit/processors.hpp"
#include "tests/unit/window_filters.hpp"

namespace tofgraph {
namespace {

using test::expect_near, test::extent, test::Image, test::nan, test::random_image, test::random_sigma, test::Result,
    test::run;

TEST(WindowFilters, AgreeWithTheEquationsInDoublePrecision) {
  struct Case {
    std::string line;
    int window;
    double h, rho;
    std::ptrdiff_t rows, columns;
  };
  const std::vector<Case> cases = {
      {"yaroslavsky strength='20 mm'", 7, 0.020, INFINITY, 204, 204},
      {"yaroslavsky strength='3.91 mm' window=3", 3, 0.00391, INFINITY, 31, 77},
      {"yaroslavsky strength='1 m' window=9", 9, 1.0, INFINITY, 60, 45},
      {"yaroslavsky strength='20 mm' window=1", 1, 0.020, INFINITY, 9, 9},
      {"bilateral strength='20 mm'", 7, 0.020, 5, 204, 204},
      {"bilateral strength='50 mm' rho='1.5 px' window=11", 11, 0.050, 1.5, 150, 13},
      {"bilateral strength='20 mm' window=7", 7, 0.020, 5, 7, 7},
  };
  for (const Case& c : cases) {
    const Image depth = random_image(c.rows, c.columns, 7), sigma = random_sigma(depth, 8);
    const auto h = [&](auto, auto) { return c.h; };
    const test::Denoised expected =
        test::averaged(depth, sigma, c.window, test::bilateral_weight(depth, h, c.rho), {.h = h});
    test::on_each_processor([&](const std::string& processor) {
      const Result with = run(c.line, depth, &sigma), without = run(c.line, depth);
      expect_near(with.depth, expected.values, 1e-5, processor + ": " + c.line);
      // Lengths of up to 7 m are rounded to 0.5 um, which affects the squares of their differences over h^2.
      expect_near(with.sigma, expected.sigma, 1e-6 + 0.020 * 0.5e-6 / c.h, processor + ": sigma of " + c.line);
      expect_near(without.depth, expected.values, 1e-5, processor + ": without sigma, " + c.line);
    });
  }
}

TEST(WindowFilters, NonLocalMeansAgreesWithTheEquationInDoublePrecision) {
  struct Case {
    std::string line;
    int search, patch;
    double h, a;
    std::ptrdiff_t rows, columns;
    double invalid = 0.05;
  };
  const std::vector<Case> cases = {
      {"non_local_means strength='20 mm'", 7, 3, 0.020, 1, 204, 204},
      {"non_local_means strength='20 mm' patch_weights=uniform", 7, 3, 0.020, INFINITY, 204, 204},
      {"non_local_means strength='15 mm' search=9 patch=7 patch_sigma='2 px'", 9, 7, 0.015, 2, 70, 33},
      {"non_local_means strength='100 mm' search=21 patch=15 patch_weights=uniform", 21, 15, 0.100, INFINITY, 140, 41},
      {"non_local_means strength='20 mm'", 7, 3, 0.020, 1, 204, 204, 0},
      {"non_local_means strength='20 mm' patch_weights=uniform patch=5", 7, 5, 0.020, INFINITY, 204, 35, 0},
      {"non_local_means strength='20 mm' patch=5", 7, 5, 0.020, 1, 24, 35, 0},
      {"non_local_means strength='20 mm' search=3 patch=1", 3, 1, 0.020, 1, 7, 50},
  };
  for (const Case& c : cases) {
    const Image depth = random_image(c.rows, c.columns, 9, c.invalid), sigma = random_sigma(depth, 8);
    const auto h = [&](auto, auto) { return c.h; };
    const test::Denoised expected =
        test::averaged(depth, sigma, c.search, test::non_local_means_weight(depth, h, c.patch, c.a),
                       {.h = h, .patch = c.patch, .a = c.a});
    test::on_each_processor([&](const std::string& processor) {
      const Result with = run(c.line, depth, &sigma), without = run(c.line, depth);
      expect_near(with.depth, expected.values, 1e-5, processor + ": " + c.line);
      expect_near(with.sigma, expected.sigma, 2e-6, processor + ": sigma of " + c.line);
      expect_near(without.depth, expected.values, 1e-5, processor + ": without sigma, " + c.line);
    });
  }
}

TEST(WindowFilters, RobustAndGuidedAgreesWithItsDefinitionInDoublePrecision) {
  const double s = 0.010, relative = s * 4 * M_PI * 20e6 / 299792458;
  const Image depth = random_image(80, 61, 11);
  Image amplitude(80, 61), sigma(80, 61);
  test::add_noise(amplitude, 30, 3);
  for (float& a : amplitude.values) a += 1000;
  for (std::size_t i = 0; i < sigma.values.size(); ++i)
    sigma.values[i] = std::isnan(depth.values[i]) ? nan : static_cast<float>(s);
  const auto weight = test::robust_weight(depth, amplitude, 0.020, 5, s, relative);
  const test::Denoised expected =
      test::averaged(depth, sigma, 7, weight,
                     {.h = [](auto, auto) { return 0.020; }, .patch = 5, .a = 1, .robust = true, .guided = true});
  test::on_each_processor([&](const std::string& processor) {
    Harness stage("non_local_means strength='20 mm' patch=5 patch_weights=robust guide=amplitude");
    stage.put<float>("depth", extent(depth), depth.values);
    stage.put<float>("amplitude", extent(depth), amplitude.values);
    stage.put<float>("sigma", extent(depth), sigma.values, {.unit = "m", .of = "depth", .applied = "", .from = ""});
    stage.metadata().modulation_frequency = 20e6;
    stage.run();
    expect_near(stage.get<float>("depth"), expected.values, 1e-5, processor);
    expect_near(stage.get<float>("sigma"), expected.sigma, 2e-6, processor + ": sigma");
  });
}

TEST(WindowFilters, FollowTheSigmaOfEachPixel) {
  const Image depth = random_image(90, 101, 3), sigma = random_sigma(depth, 4);
  std::vector<float> known;
  for (const float s : sigma.values)
    if (!std::isnan(s)) known.push_back(s);
  std::ranges::sort(known);
  const std::size_t half = known.size() / 2;
  const double median = known.size() % 2 != 0 ? known[half] : (known[half - 1] + known[half]) / 2.0;
  const auto fixed = [&](auto, auto) { return std::sqrt(2.0) * median; };
  expect_near(run("yaroslavsky", depth, &sigma).depth,
              test::averaged(depth, sigma, 7, test::yaroslavsky_weight(depth, fixed), {.h = fixed}).values, 1e-5,
              "auto");
  const auto own = [&](auto r, auto c) { return std::sqrt(2.0) * sigma.at(r, c); };
  const test::Denoised expected = test::averaged(depth, sigma, 7, test::bilateral_weight(depth, own, 5), {.h = own});
  const Result adaptive = run("bilateral sigma_adaptive=true", depth, &sigma);
  expect_near(adaptive.depth, expected.values, 1e-5, "adaptive");
  expect_near(adaptive.sigma, expected.sigma, 1e-6, "sigma of adaptive");
}

}  // namespace
}  // namespace tofgraph
