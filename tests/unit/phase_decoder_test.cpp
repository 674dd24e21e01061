// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Arbitrary exposures: distance and amplitude, compared with known ones and with QR in double; undecodable input.
#include <gtest/gtest.h>
#include <tofgraph/channels.hpp>

#include "tests/unit/cameras.hpp"
#include "tests/unit/phase_decoder_fixture.hpp"
#include "tests/unit/processors.hpp"

using namespace tofgraph;
using namespace test;

namespace {

/// Standard deviation of the distance from the covariance of the same fit and the gradient of the angle.
double sigma_of(const Steps& steps, const Eigen::Vector3d& fit, double noise) {
  Eigen::MatrixXd design(static_cast<Eigen::Index>(steps.size()), 3);
  for (Eigen::Index k = 0; k < design.rows(); ++k) {
    const double phase = steps[static_cast<std::size_t>(k)].phase;
    design.row(k) << std::cos(phase), -std::sin(phase), 1;
  }
  const Eigen::Matrix3d covariance = noise * noise * (design.transpose() * design).inverse();
  const double square = fit[0] * fit[0] + fit[1] * fit[1];
  const Eigen::Vector2d gradient(-fit[1] / square, fit[0] / square);
  return c_light / (4 * pi * steps[0].frequency) * std::sqrt(gradient.dot(covariance.topLeftCorner<2, 2>() * gradient));
}

TEST(PhaseDecoder, NineImagesAreExactOverTheirWholeRange) {
  const Steps steps = three_at(nine_images);
  const double range = range_of(8e6);
  EXPECT_NEAR(range, 18.74, 0.005);
  const Scene scene{.distances = ramp(0.001, range - 0.001, 20000)};
  const auto samples = samples_of(steps, scene);
  test::on_each_processor([&](const std::string& processor) {
    const Decoded decoded = decode("phase_decoder", steps, samples);
    double worst = 0;
    for (std::size_t i = 0; i < scene.distances.size(); ++i) {
      worst = std::max(worst, std::abs(decoded.distance[i] - scene.distances[i]));
      ASSERT_EQ(decoded.flags[i], 0) << scene.distances[i] << " m, " << processor;
      ASSERT_NEAR(decoded.amplitude[i], 1000, 0.01) << processor;
    }
    RecordProperty(processor + "_worst_m", std::to_string(worst));
    EXPECT_LT(worst, 1e-4) << processor;
  });
}

TEST(PhaseDecoder, AnyStepsAreLeastSquares) {
  std::mt19937 generator(3);
  const auto even = [](int count) { return three_at({20e6}, count); };
  const Steps uneven = {{10 * deg, 20e6}, {75 * deg, 20e6}, {200 * deg, 20e6}, {290 * deg, 20e6}, {333 * deg, 20e6}};
  const Steps three_uneven = {{0, 20e6}, {80 * deg, 20e6}, {210 * deg, 20e6}};
  for (const Steps& steps : {even(3), even(5), even(8), uneven, three_uneven}) {
    const Scene scene{.distances = ramp(0.01, range_of(20e6) - 0.01, 3001), .noise = 20};
    const auto samples = samples_of(steps, scene);
    const std::size_t pixels = scene.distances.size();
    const Decoded decoded = decode("phase_decoder inconsistent_above=off", steps, samples, 20 / std::sqrt(2.0));
    double worst = 0, worst_sigma = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
      std::vector<double> c;
      for (std::size_t k = 0; k < steps.size(); ++k) c.push_back(samples[k * pixels + i]);
      const Eigen::Vector3d fit = min_squares(steps, c);
      const double d = c_light / (4 * pi * 20e6) * std::atan2(fit[1], fit[0]);
      worst = std::max(worst, std::abs(std::remainder(decoded.distance[i] - d, range_of(20e6))));
      ASSERT_NEAR(decoded.amplitude[i], std::hypot(fit[0], fit[1]), 2e-3);
      worst_sigma = std::max(worst_sigma, std::abs(decoded.sigma[i] / sigma_of(steps, fit, 20) - 1));
    }
    EXPECT_LT(worst, 1e-6) << steps.size() << " steps";
    EXPECT_LT(worst_sigma, 1e-4) << steps.size() << " steps";
  }
}

TEST(PhaseDecoder, AnOffsetOfTheSamplesDoesNotMatter) {
  const Steps steps = {{0, 20e6}, {80 * deg, 20e6}, {210 * deg, 20e6}};
  const Scene scene{.distances = ramp(0.1, 7, 50)};
  auto samples = samples_of(steps, scene);
  for (float& c : samples) c += 500;
  const Decoded decoded = decode("phase_decoder", steps, samples);
  for (std::size_t i = 0; i < 50; ++i) EXPECT_NEAR(decoded.distance[i], scene.distances[i], 2e-6);
}

TEST(PhaseDecoder, TapsGiveSaturationAndLight) {
  const Steps steps = three_at({60e6, 50e6});
  const std::size_t pixels = 3;
  std::vector<std::uint16_t> taps;
  const double d = 4.321, mean = 2000;
  for (const auto& step : steps) {
    const double c = 1000 * std::cos(4 * pi * step.frequency * d / c_light + step.phase);
    for (const double sign : {1.0, -1.0})
      for (std::size_t i = 0; i < pixels; ++i)
        taps.push_back(static_cast<std::uint16_t>(std::lround(i == 1 && sign > 0 ? 30000 : mean + sign * c / 2)));
  }
  Harness stage("phase_decoder");
  stage.camera(profile(steps, pixels));
  stage.put<std::uint16_t>("taps", {steps.size(), 2, 1, pixels}, taps);
  stage.run();
  EXPECT_NEAR(stage.get<float>("distance")[0], d, 1e-3);
  EXPECT_NEAR(stage.get<float>("intensity")[0], mean, 0.1);
  EXPECT_EQ(stage.get<std::uint16_t>("flags")[0], 0);
  EXPECT_TRUE(stage.get<std::uint16_t>("flags")[1] & flag::saturated);
  EXPECT_TRUE(std::isnan(stage.get<float>("distance")[1]));
}

TEST(PhaseDecoder, IntegersAndFloatsSayTheSame) {
  const Steps steps = three_at(nine_images);
  const Scene scene{.distances = ramp(0.3, 18.4, 999), .noise = 5};
  const auto whole = samples_of<std::int16_t>(steps, scene);
  const std::vector<float> same(whole.begin(), whole.end());
  const std::vector<std::int32_t> wide(whole.begin(), whole.end());
  const auto expected = decode("phase_decoder", steps, same).distance;
  EXPECT_EQ(decode("phase_decoder", steps, whole).distance, expected);
  EXPECT_EQ(decode("phase_decoder", steps, wide).distance, expected);
}

TEST(PhaseDecoder, WhatIsNoNumberIsInvalid) {
  const Steps steps = three_at(nine_images);
  auto samples = samples_of(steps, {.distances = ramp(1, 2, 40)});
  samples[4 * 40 + 7] = std::nanf("");
  samples[8 * 40 + 9] = std::numeric_limits<float>::infinity();
  const Decoded decoded = decode("phase_decoder", steps, samples);
  for (std::size_t i = 0; i < 40; ++i) {
    EXPECT_EQ(std::isnan(decoded.distance[i]), i == 7 || i == 9) << i;
    EXPECT_EQ((decoded.flags[i] & flag::invalid) != 0, i == 7 || i == 9) << i;
  }
}

/// The four images in any order, either sign, exchanged taps: correct as soon as the exposures are declared correctly.
TEST(FourPhaseDecoder, TakesAnyOrderOfItsSteps) {
  const Scene scene{.distances = ramp(0.05, 7.4, 500)};
  const std::vector<std::vector<double>> orders = {{0, 90, 180, 270}, {0, 270, 180, 90}, {180, 270, 0, 90},
                                                   {0, 180, 90, 270}, {270, 0, 180, 90}, {90, 0, -90, 180}};
  for (const auto& order : orders) {
    Steps steps;
    for (const double phase : order) steps.push_back({phase * deg, 20e6});
    const auto samples = samples_of(steps, scene);
    for (const char* stage : {"four_phase_decoder", "phase_decoder"}) {
      const Decoded decoded = decode(stage, steps, samples);
      for (std::size_t i = 0; i < 500; ++i)
        ASSERT_NEAR(decoded.distance[i], scene.distances[i], 2e-6) << stage << " " << order[0] << " " << order[1];
    }
  }
}

std::string message_of(const std::string& stage, const Steps& steps, std::size_t images) {
  try {
    Harness harness(stage);
    harness.camera(profile(steps, 4));
    harness.put<float>("phases", {images, 1, 4}, std::vector<float>(images * 4, 1));
    harness.prepare();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no error";
}

void expect_words(const std::string& text, const std::string& words) {
  EXPECT_NE(text.find(words), std::string::npos) << text;
}

TEST(PhaseDecoder, SaysWhatCannotBeDecoded) {
  expect_words(message_of("phase_decoder", {{0, 0}, {pi, 0}}, 2), "2 exposures, expected 3 to 32");
  expect_words(message_of("phase_decoder", {{0, 0}, {pi, 0}, {0, 0}}, 3),
               "the steps 0, 180, 0 deg are only 2 different");
  expect_words(message_of("phase_decoder", {{0, 0}, {0.001, 0}, {0.002, 0}}, 3), "the phase is undetermined");
  expect_words(message_of("phase_decoder", {{0, 20e6}, {2, 20e6}, {4, 0}}, 3),
               "exposure 2 has a frequency of 0 Hz or none");
  expect_words(message_of("phase_decoder", three_at({20e6, 31.7e6 + 1234}), 6),
               "have no common range: 6 exposures: 0, 120, 240 deg at 20 MHz; 0, 120, 240 deg at 31.7012 MHz");
  EXPECT_EQ(message_of("phase_decoder max_range=20m", three_at({20e6, 31.7e6 + 1234}), 6), "no error");
  expect_words(message_of("phase_decoder", three_at({20e6, 30e6, 40e6, 50e6}), 12), "up to three");
  expect_words(message_of("phase_decoder modulation_frequency=20MHz", three_at({20e6, 30e6}), 6), "one frequency");
  for (const char* parameter :
       {"max_range=5m", "wrap_confidence=0.9", "phase_error=0.1rad", "invalidate_wrapped=false"})
    expect_words(message_of(std::string("phase_decoder ") + parameter, three_at({20e6}), 3),
                 "is for several modulation frequencies");
  expect_words(message_of("phase_decoder", three_at({20e6}, 4), 3), "3 images");
  expect_words(message_of("four_phase_decoder", three_at({20e6}), 3), "use phase_decoder for it");
}

}  // namespace
