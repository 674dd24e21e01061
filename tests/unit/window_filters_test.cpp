// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The filters with weights exp(-d^2 / h^2) over a window: against their equations in double precision, on every
// instruction set of this machine, and by properties that need no reference.
#include <tofgraph/channels.hpp>
#include <tofgraph/harness.hpp>

#include <gtest/gtest.h>

#include <cstdio>

#include "tests/unit/denoise_reference.hpp"
#include "tests/unit/processors.hpp"

namespace tofgraph {
namespace {

using test::Image;
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

std::vector<std::uint64_t> extent(const Image& image) {
  return {static_cast<std::uint64_t>(image.rows), static_cast<std::uint64_t>(image.columns)};
}

struct Result {
  std::vector<float> depth, sigma;
  std::vector<std::uint16_t> flags;
};

Result run(const std::string& line, const Image& depth, const Image* sigma = nullptr) {
  Harness stage(line);
  stage.put<float>("depth", extent(depth), depth.values);
  if (sigma != nullptr)
    stage.put<float>("sigma", extent(*sigma), sigma->values, {.unit = "m", .of = "depth", .applied = "", .from = ""});
  stage.run();
  return {stage.get<float>("depth"), sigma != nullptr ? stage.get<float>("sigma") : std::vector<float>(),
          stage.get<std::uint16_t>("flags")};
}

/// Steps, slopes and noise, by default with 5 % of the pixels invalid.
Image random_image(std::ptrdiff_t rows, std::ptrdiff_t columns, unsigned seed, double invalid = 0.05) {
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
  test::add_noise(image, 0.010, seed);
  test::drop_pixels(image, invalid, seed + 1);
  return image;
}

/// A sigma of 5 to 20 mm.
Image random_sigma(const Image& like, unsigned seed) {
  Image sigma(like.rows, like.columns);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> level(0.005F, 0.020F);
  for (std::size_t i = 0; i < sigma.values.size(); ++i)
    sigma.values[i] = std::isnan(like.values[i]) ? nan : level(random);
  return sigma;
}

void expect_near(const std::vector<float>& found, const std::vector<double>& expected, double tolerance,
                 const std::string& what) {
  ASSERT_EQ(found.size(), expected.size());
  double most = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    ASSERT_EQ(std::isnan(found[i]), std::isnan(expected[i])) << what << ", pixel " << i;
    if (!std::isnan(expected[i])) most = std::max(most, std::abs(static_cast<double>(found[i]) - expected[i]));
  }
  EXPECT_LE(most, tolerance) << what;
}

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
    const auto weight = test::bilateral_weight(
        depth, [&](auto, auto) { return c.h; }, c.rho);
    const test::Denoised expected = test::averaged(depth, sigma, c.window, weight);
    test::on_each_processor([&](const std::string& processor) {
      const Result with = run(c.line, depth, &sigma), without = run(c.line, depth);
      expect_near(with.depth, expected.values, 1e-5, processor + ": " + c.line);
      expect_near(with.sigma, expected.sigma, 1e-6, processor + ": sigma of " + c.line);
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
    const auto weight = test::non_local_means_weight(
        depth, [&](auto, auto) { return c.h; }, c.patch, c.a);
    const test::Denoised expected = test::averaged(depth, sigma, c.search, weight);
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
  const test::Denoised expected = test::averaged(depth, sigma, 7, weight);
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
              test::averaged(depth, sigma, 7, test::yaroslavsky_weight(depth, fixed)).values, 1e-5, "auto");
  const auto own = [&](auto r, auto c) { return std::sqrt(2.0) * sigma.at(r, c); };
  const test::Denoised expected = test::averaged(depth, sigma, 7, test::bilateral_weight(depth, own, 5));
  const Result adaptive = run("bilateral sigma_adaptive=true", depth, &sigma);
  expect_near(adaptive.depth, expected.values, 1e-5, "adaptive");
  expect_near(adaptive.sigma, expected.sigma, 1e-6, "sigma of adaptive");
}

const std::vector<std::string> filters = {"yaroslavsky", "bilateral", "non_local_means",
                                          "non_local_means patch_weights=uniform",
                                          "non_local_means patch_weights=robust"};

TEST(WindowFilters, LeaveConstantImagesAsTheyAre) {
  for (const std::string& filter : filters) {
    Image depth(40, 51);
    std::ranges::fill(depth.values, 1.2345678F);
    const std::vector<float> before = depth.values;
    EXPECT_EQ(run(filter + " strength='3.91 mm'", depth).depth, before) << filter;
  }
}

/// Two planes 200 mm apart, divided by the line across * c + down * r = 60.
Image edge_of_200_mm(std::ptrdiff_t across, std::ptrdiff_t down) {
  Image depth(40, 51);
  for (std::ptrdiff_t r = 0; r < 40; ++r)
    for (std::ptrdiff_t c = 0; c < 51; ++c) depth(r, c) = across * c + down * r > 60 ? 1.1F : 1.3F;
  return depth;
}

TEST(WindowFilters, MoveAnEdgeOfTenStrengthsByNothing) {
  for (const std::string& filter : filters) {
    const bool uniform = filter.ends_with("uniform");
    for (const auto& [across, down] : {std::pair{2, 0}, {0, 3}, {2, 1}, {1, -1}}) {
      // On a slanted edge two patches may differ by their middle only, of which equal weights take no more notice than
      // of any other pixel: see below.
      if (uniform && across != 0 && down != 0) continue;
      const Image depth = edge_of_200_mm(across, down);
      EXPECT_EQ(run(filter + " strength='20 mm'", depth).depth, depth.values) << filter << across << down;
    }
  }
}

TEST(WindowFilters, MoveASlantedEdgeWithEqualPatchWeightsAsTheEquationDoes) {
  // A pair that differs in one pixel of nine has the weight exp(-100 / 9), which moves a pixel by 3 um of the step.
  const Image depth = edge_of_200_mm(2, 1);
  const auto weight = test::non_local_means_weight(
      depth, [](auto, auto) { return 0.020; }, 3, INFINITY);
  Image sigma = depth;
  std::ranges::fill(sigma.values, 0.0F);
  expect_near(run("non_local_means patch_weights=uniform strength='20 mm'", depth).depth,
              test::averaged(depth, sigma, 7, weight).values, 2e-7, "slanted");
}

TEST(WindowFilters, CommuteWithATranslation) {
  const Image whole = random_image(80, 90, 21);
  Image part(60, 70);
  for (std::ptrdiff_t r = 0; r < 60; ++r)
    for (std::ptrdiff_t c = 0; c < 70; ++c) part(r, c) = static_cast<float>(whole.at(r + 13, c + 7));
  for (const std::string& filter : filters) {
    Image of_whole(80, 90), of_part(60, 70);
    of_whole.values = run(filter + " strength='20 mm'", whole).depth;
    of_part.values = run(filter + " strength='20 mm'", part).depth;
    for (std::ptrdiff_t r = 4; r < 56; ++r) {
      for (std::ptrdiff_t c = 4; c < 66; ++c) {
        if (!part.valid(r, c)) continue;
        ASSERT_NEAR(of_part.at(r, c), of_whole.at(r + 13, c + 7), 1e-6) << filter << ", " << r << ", " << c;
      }
    }
  }
}

TEST(WindowFilters, TakeWhatIsNoLengthAsInvalid) {
  for (const std::string& filter : filters) {
    Image depth(9, 9), clean(9, 9);
    std::ranges::fill(depth.values, 2.0F);
    depth(4, 4) = INFINITY;
    depth(0, 0) = -INFINITY;
    depth(8, 3) = nan;
    const Result result = run(filter + " strength='20 mm'", depth);
    for (std::size_t i = 0; i < 81; ++i) {
      const bool good = std::isfinite(depth.values[i]);
      EXPECT_EQ(result.flags[i], good ? 0 : flag::invalid) << filter;
      EXPECT_EQ(std::isnan(result.depth[i]), !good) << filter;
      if (good) {
        EXPECT_EQ(result.depth[i], 2.0F) << filter;
      }
    }
    const Result filled = run(filter + " strength='20 mm' fill=true", depth);
    EXPECT_EQ(filled.flags[40], flag::filled) << filter;
    EXPECT_EQ(filled.depth[40], 2.0F) << filter;

    std::ranges::fill(depth.values, nan);
    const Result none = run(filter + " strength='20 mm' fill=true", depth);
    EXPECT_TRUE(std::ranges::all_of(none.depth, [](float v) { return std::isnan(v); })) << filter;
    EXPECT_TRUE(std::ranges::all_of(none.flags, [](auto v) { return v == flag::invalid; })) << filter;
  }
}

std::string said(const std::string& line, bool sigma = false) {
  const Image depth = random_image(20, 30, 1), noise = random_sigma(depth, 2);
  try {
    run(line, depth, sigma ? &noise : nullptr);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(WindowFilters, SayWhatIsWrong) {
  const auto expect = [](const std::string& line, const std::string& text) {
    EXPECT_NE(said(line).find(text), std::string::npos) << line << " said: " << said(line);
  };
  expect("yaroslavsky strength='20 mm' window=6", "is 6, must be odd, so that the pixel is its centre, e.g. window: 7");
  expect("yaroslavsky strength='20 mm' window=21", "is 21 pixels, the image has only 20 x 30");
  expect("bilateral strength='0 mm'", "at least 1 um, e.g. 20 mm");
  expect("bilateral strength='-3 mm'", "at least 1 um, e.g. 20 mm");
  expect("bilateral", "auto needs the channel sigma, which is not there");
  expect("bilateral strength='20 mm' sigma_adaptive=true", "needs the channel sigma");
  expect("non_local_means strength='20 mm' search=5 patch=7", "is 7 pixels, greater than search, which is 5");
  expect("non_local_means strength='20 mm' search=4", "must be odd");
  expect("non_local_means strength='20 mm' guide=amplitude", "what arrives has no amplitude");
  EXPECT_EQ(said("non_local_means sigma_adaptive=true", true), "");
}

TEST(WindowFilters, AreNoInputOfTheNonLinearityModels) {
  Harness stage("optimized_bistatic");
  stage.camera("camcube2");
  stage.put<float>("distance", {204, 204}, std::vector<float>(204 * 204, 1),
                   {.unit = "m", .of = "", .applied = "bilateral denoised", .from = ""});
  EXPECT_THROW(stage.run(), std::runtime_error);
}

/// Root mean square errors in mm.
struct Errors {
  double all, flat, edge;
};

Errors errors(const std::vector<float>& found, const Image& truth) {
  const std::vector<bool> edges = test::edges_of(truth, 3);
  double squares[2] = {0, 0}, count[2] = {0, 0};
  for (std::size_t i = 0; i < found.size(); ++i) {
    const double error = 1e3 * (static_cast<double>(found[i]) - static_cast<double>(truth.values[i]));
    squares[edges[i] ? 1 : 0] += error * error;
    count[edges[i] ? 1 : 0] += 1;
  }
  return {std::sqrt((squares[0] + squares[1]) / (count[0] + count[1])), std::sqrt(squares[0] / count[0]),
          std::sqrt(squares[1] / count[1])};
}

/// Noise of 10 mm, and of an amplitude as it belongs to it at 20 MHz: the same part of the amplitude as of a radian.
Errors denoised_boxes(const std::string& line, double gap) {
  const test::Scene scene = test::box_scene(204, gap);
  Image depth = scene.depth, amplitude = scene.amplitude;
  test::add_noise(depth, 0.010, 1);
  Image relative(204, 204);
  test::add_noise(relative, 0.010 * 4 * M_PI * 20e6 / 299792458, 2);
  for (std::size_t i = 0; i < depth.values.size(); ++i) amplitude.values[i] *= 1 + relative.values[i];
  Harness stage(line);
  stage.put<float>("depth", extent(depth), depth.values);
  stage.put<float>("amplitude", extent(depth), amplitude.values);
  stage.put<float>("sigma", extent(depth), std::vector<float>(depth.values.size(), 0.010F),
                   {.unit = "m", .of = "depth", .applied = "", .from = ""});
  stage.metadata().modulation_frequency = 20e6;
  stage.run();
  const Errors result = errors(stage.get<float>("depth"), scene.depth);
  std::printf("%-75s gap %2.0f mm: all %.2f flat %.2f edge %.2f mm\n", line.c_str(), 1e3 * gap, result.all, result.flat,
              result.edge);
  return result;
}

TEST(WindowFilters, DenoiseThePalletOfBoxes) {
  const std::string robust = "non_local_means strength='20 mm' patch_weights=robust guide=amplitude";
  EXPECT_LE(denoised_boxes("yaroslavsky strength='20 mm'", 0).all, 3.9);
  EXPECT_LE(denoised_boxes("bilateral strength='20 mm'", 0).all, 4.0);
  for (const double gap : {0.0, 0.060}) {
    const Errors plain = denoised_boxes("non_local_means strength='20 mm'", gap), best = denoised_boxes(robust, gap);
    if (gap == 0) {
      EXPECT_LE(plain.all, 2.3);
    }
    EXPECT_LT(best.flat, plain.flat);
    EXPECT_LT(best.edge, plain.edge);
  }
}

}  // namespace
}  // namespace tofgraph
