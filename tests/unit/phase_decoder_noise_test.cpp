// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The standard deviation of a distance is that of the noise, and deviations not explained by noise are flagged.
#include <gtest/gtest.h>
#include <tofgraph/channels.hpp>

#include "tests/unit/cameras.hpp"
#include "tests/unit/phase_decoder_fixture.hpp"

using namespace tofgraph;
using namespace test;

namespace {

/// Repeated noisy samples of one distance.
void expect_sigma(const Steps& steps, double distance, double noise) {
  const Scene scene{.distances = std::vector<double>(40000, distance), .noise = noise, .seed = 7};
  const Decoded decoded = decode("phase_decoder", steps, samples_of(steps, scene), noise / std::sqrt(2.0));
  double sum = 0, square = 0, sigma = 0, count = 0;
  for (std::size_t i = 0; i < scene.distances.size(); ++i) {
    if (decoded.flags[i] != 0) continue;
    const double error = decoded.distance[i] - distance;
    sum += error;
    square += error * error;
    sigma += decoded.sigma[i];
    ++count;
  }
  ASSERT_GT(count, 39000);
  const double sd = std::sqrt(square / count - sum / count * (sum / count));
  EXPECT_NEAR(sd / (sigma / count), 1, 0.03) << steps.size() << " exposures at " << distance << " m";
}

TEST(PhaseDecoder, SigmaIsTheNoise) {
  for (const double distance : {0.7, 5.21, 12.3, 18.1}) expect_sigma(three_at(nine_images), distance, 20);
  expect_sigma(three_at({80.32e6, 60.24e6}, 4), 3.3, 30);
  for (const double distance : {0.5, 1.9, 2.6, 6.1})
    expect_sigma({{0, 20e6}, {80 * deg, 20e6}, {210 * deg, 20e6}}, distance, 10);
}

/// Taps with shot noise, and frequencies with a different contrast each.
TEST(PhaseDecoder, SigmaIsTheNoiseOfTaps) {
  const Steps steps = three_at(nine_images);
  const double amplitudes[] = {900, 1300, 400}, distance = 9.87, mean = 4000, read = 4, acquisition = 0.3;
  const std::size_t pixels = 40000, rows = rows_of(pixels);
  std::mt19937 generator(4);
  std::normal_distribution<double> normal;
  std::vector<std::uint16_t> taps;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const double c = amplitudes[k / 3] * std::cos(4 * pi * steps[k].frequency * distance / c_light + steps[k].phase);
    for (const double sign : {0.5, -0.5}) {
      const double counts = mean + sign * c, deviation = std::sqrt(read * read + acquisition * counts);
      for (std::size_t i = 0; i < pixels; ++i)
        taps.push_back(static_cast<std::uint16_t>(std::lround(counts + deviation * normal(generator))));
    }
  }
  Harness stage("phase_decoder read_noise=4counts shot_noise=0.3counts");
  stage.camera(profile(steps, pixels));
  stage.put<std::uint16_t>("taps", {steps.size(), 2, rows, pixels / rows}, taps);
  stage.run();
  const auto distances = stage.get<float>("distance"), sigmas = stage.get<float>("sigma");
  double sum = 0, square = 0, sigma = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    ASSERT_NEAR(distances[i], distance, 0.2);
    sum += distances[i] - distance;
    square += std::pow(distances[i] - distance, 2);
    sigma += sigmas[i];
  }
  const double n = static_cast<double>(pixels), sd = std::sqrt(square / n - sum / n * (sum / n));
  EXPECT_NEAR(sd / (sigma / n), 1, 0.03);
}

TEST(PhaseDecoder, WithoutNoiseNothingIsUncertain) {
  const Steps steps = three_at(nine_images);
  const Scene scene{.distances = ramp(0.1, 18.6, 500)};
  const std::string zero = " read_noise=0counts shot_noise=0counts";
  Harness harness("phase_decoder" + zero);
  harness.camera(profile(steps, 500));
  harness.put<float>("phases", {9, 1, 500}, samples_of(steps, scene));
  harness.run();
  for (std::size_t i = 0; i < 500; ++i) {
    EXPECT_NEAR(harness.get<float>("distance")[i], scene.distances[i], 1e-4);
    EXPECT_EQ(harness.get<std::uint16_t>("flags")[i], 0);
  }
  EXPECT_FALSE(harness.has("sigma"));
}

TEST(PhaseDecoder, SamplesThatDoNotFitAreInconsistent) {
  const Steps steps = three_at({20e6}, 8);
  const std::size_t pixels = 20000;
  const double noise = 10;
  Scene scene{.distances = ramp(0.3, 7, pixels), .noise = noise};
  const auto good = samples_of(steps, scene);
  auto bad = good;
  for (std::size_t i = 0; i < pixels; ++i) bad[3 * pixels + i] += 150;
  const auto count = [&](const std::vector<float>& samples) {
    const Decoded decoded = decode("phase_decoder", steps, samples, noise / std::sqrt(2.0));
    return std::ranges::count_if(decoded.flags, [](auto f) { return (f & flag::inconsistent) != 0; });
  };
  EXPECT_LE(count(good), 2) << "five standard deviations: one of 3.5 million";
  EXPECT_EQ(count(bad), pixels);
}

TEST(PhaseDecoder, FlagsAsMuchOfGoodSamplesAsTheDeviationsSay) {
  const double share = std::erfc(3 / std::sqrt(2.0));
  for (const int count : {4, 5, 8}) {
    const Steps steps = three_at({20e6}, count);
    const std::size_t pixels = 100000;
    const Scene scene{.distances = ramp(0.3, 7, pixels), .noise = 10, .seed = 31};
    const Decoded decoded =
        decode("phase_decoder inconsistent_above=3", steps, samples_of(steps, scene), 10 / std::sqrt(2.0));
    const auto flagged = std::ranges::count_if(decoded.flags, [](auto f) { return (f & flag::inconsistent) != 0; });
    EXPECT_NEAR(static_cast<double>(flagged), share * pixels, 5 * std::sqrt(share * pixels)) << count;
  }
}

}  // namespace
