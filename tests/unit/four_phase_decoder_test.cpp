// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Decoder.IsAs*
// Rooms: graph cli
// The decoder, compared with the arctangent in double, and each reason for a flag.
#include <gtest/gtest.h>
#include <tofgraph/channels.hpp>
#include <tofgraph/harness.hpp>
#include <tofgraph/physics/constants.hpp>

#include "tests/unit/cameras.hpp"
#include "tests/unit/message_of.hpp"
#include "tests/unit/processors.hpp"

#include <cmath>
#include <random>

using namespace tofgraph;

namespace {

constexpr double c_light = 299792458.0, pi = 3.14159265358979323846;

/// c_k = amplitude cos(Psi + k pi/2) for each pixel, image by image.
template <class T = float> std::vector<T> phases_of(const std::vector<double>& psi, double amplitude) {
  std::vector<T> phases;
  for (int k = 0; k < 4; ++k) {
    for (const double p : psi)
      phases.push_back(static_cast<T>(std::nearbyint(1024 * amplitude * std::cos(p + k * pi / 2)) / 1024));
  }
  return phases;
}

/// Distance from the samples, in double: half paths from 0 to the unambiguous range.
template <class T> double distance_of(const std::vector<T>& phases, std::size_t pixel, double frequency) {
  const std::size_t pixels = phases.size() / 4;
  const auto c = [&](std::size_t k) { return static_cast<double>(phases[k * pixels + pixel]); };
  double psi = std::atan2(c(3) - c(1), c(0) - c(2));
  if (psi < 0) psi += 2 * pi;
  return c_light / (4 * pi * frequency) * psi;
}

/// Difference of two distances modulo the unambiguous range.
double apart(double a, double b, double frequency) {
  return std::abs(std::remainder(a - b, c_light / (2 * frequency)));
}

TEST(Decoder, IsAsExactAsSinglePrecisionAtAnyFrequency) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> any(0, 2 * pi);
  std::vector<double> psi(1000 * 999);
  for (double& p : psi) p = any(generator);
  for (int i = 0; i < 8; ++i) psi[static_cast<std::size_t>(i)] = i * pi / 4;
  const std::vector<float> phases = phases_of(psi, 5000);
  for (const double frequency : {20e6, 30e6, 7.5e6}) {
    const auto range = static_cast<float>(c_light / (2 * frequency));
    const double ulp = std::nextafter(range, 100.0F) - range;
    test::on_each_processor([&](const std::string& processor) {
      Harness stage("four_phase_decoder");
      stage.metadata().modulation_frequency = frequency;
      stage.put<float>("phases", {4, 999, 1000}, phases);
      stage.run();
      const std::vector<float> distance = stage.get<float>("distance"), amplitude = stage.get<float>("amplitude");
      double worst = 0;
      for (std::size_t i = 0; i < psi.size(); ++i) {
        worst = std::max(worst, apart(distance[i], distance_of(phases, i, frequency), frequency));
        ASSERT_TRUE(distance[i] >= 0 && distance[i] < range)
            << processor << ", " << distance[i] << " of " << phases[i] << " " << phases[i + psi.size()] << " "
            << phases[i + 2 * psi.size()] << " " << phases[i + 3 * psi.size()];
        ASSERT_NEAR(amplitude[i], 5000, 0.002) << processor;
      }
      testing::Test::RecordProperty(processor + "_ulp", std::to_string(worst / ulp));
      EXPECT_LE(worst, 1.5 * ulp) << processor << " at " << frequency;
      for (const std::uint16_t flags : stage.get<std::uint16_t>("flags")) ASSERT_EQ(flags, 0);
      EXPECT_FALSE(stage.has("sigma")) << "without a camera the noise is not known";
      EXPECT_FALSE(stage.has("intensity")) << "phases do not show it";
    });
  }
}

TEST(Decoder, WrapsIntoTheRange) {
  Harness stage("four_phase_decoder");
  stage.metadata().modulation_frequency = 20e6;
  // sine and cosine of: 0, just below 2 pi (rounds to a full turn), -0, pi, 3 pi / 2
  stage.put<float>("phases", {4, 1, 5},
                   {100, 100, 100, -100, 0, 0, 1e-8F, 0, 0, 100, -100, -100, -100, 100, 0, 0, 0, -0.0F, 0, -100});
  stage.run();
  const auto distance = stage.get<float>("distance");
  const double range = c_light / 40e6;
  EXPECT_EQ(distance[0], 0);
  EXPECT_EQ(distance[1], 0);
  EXPECT_EQ(distance[2], 0);
  EXPECT_NEAR(distance[3], range / 2, 3e-7);
  EXPECT_NEAR(distance[4], range * 3 / 4, 5e-7);
}

template <class T> void decodes_integers() {
  std::vector<double> psi;
  for (int i = 0; i < 7 * 13; ++i) psi.push_back(0.07 * i);  // no multiple of the vector length
  const std::vector<T> phases = phases_of<T>(psi, 9000);
  Harness stage("four_phase_decoder");
  stage.metadata().modulation_frequency = 20e6;
  stage.put<T>("phases", {4, 7, 13}, phases);
  stage.run();
  const auto distance = stage.get<float>("distance");
  ASSERT_EQ(stage.extent("distance"), (std::vector<std::uint64_t>{7, 13}));
  for (std::size_t i = 0; i < psi.size(); ++i) EXPECT_LT(apart(distance[i], distance_of(phases, i, 20e6), 20e6), 8e-7);
}

TEST(Decoder, Takes16BitPhases) { decodes_integers<std::int16_t>(); }
TEST(Decoder, Takes32BitPhases) { decodes_integers<std::int32_t>(); }

TEST(Decoder, RefusesOtherPhases) {
  Harness stage("four_phase_decoder");
  stage.put<std::uint8_t>("phases", {4, 1, 1}, {1, 2, 3, 4});
  EXPECT_NE(message_of([&] { stage.prepare(); }).find("expected float32, int16 or int32"), std::string::npos);
  Harness empty("four_phase_decoder");
  EXPECT_NE(message_of([&] { empty.prepare(); }).find("needs taps or phases"), std::string::npos);
}

TEST(Decoder, TapsGiveIntensityAndSaturation) {
  const test::Camera camera = test::camcube2();  // full well 30000 counts
  Harness stage("four_phase_decoder");
  stage.camera(test::profile_of(camera.view));
  stage.metadata().modulation_frequency = 20e6;
  // two pixels: A0 B0 A1 B1 .. of a clean one, and of one with a tap at the full well
  const std::vector<std::uint16_t> clean = {11000, 9000, 10500, 9500, 9000, 11000, 9500, 10500};
  std::vector<std::uint16_t> taps;
  for (std::size_t k = 0; k < 8; ++k) {
    taps.push_back(clean[k]);
    taps.push_back(k == 5 ? 30000 : clean[k]);
  }
  stage.put<std::uint16_t>("taps", {4, 2, 1, 2}, taps);
  stage.run();
  EXPECT_FLOAT_EQ(stage.get<float>("intensity")[0], 10000);
  EXPECT_FLOAT_EQ(stage.get<float>("amplitude")[0], static_cast<float>(std::hypot(4000, 2000) / 2));
  EXPECT_NEAR(stage.get<float>("distance")[0], c_light / (4 * pi * 20e6) * (std::atan2(-2000, 4000) + 2 * pi), 8e-7);
  const auto flags = stage.get<std::uint16_t>("flags");
  EXPECT_EQ(flags[0], 0);
  EXPECT_EQ(flags[1], flag::saturated | flag::invalid | flag::inconsistent);
  EXPECT_TRUE(std::isnan(stage.get<float>("distance")[1]));
  EXPECT_TRUE(std::isnan(stage.get<float>("sigma")[1]));
  EXPECT_FALSE(std::isnan(stage.get<float>("amplitude")[1])) << "what was measured is kept";
  // sigma: a tap's variance is 3^2 + 0.012 * 10000, a sample's twice that
  const double sample = std::sqrt(2 * (9 + 0.012 * 10000)), amplitude = std::hypot(4000, 2000) / 2;
  EXPECT_NEAR(stage.get<float>("sigma")[0], c_light / (4 * pi * 20e6) * sample / (std::sqrt(2) * amplitude), 1e-8);
  EXPECT_EQ(stage.of("sigma"), "distance");
}

TEST(Decoder, TheLargestCountIsSaturatedWithoutAFullWell) {
  Harness stage("four_phase_decoder");
  stage.metadata().modulation_frequency = 20e6;
  stage.put<std::uint16_t>("taps", {4, 2, 1, 2},
                           {65535, 65534, 1000, 1000, 1500, 1500, 1500, 1500,  //
                            1000, 1000, 2000, 2000, 1500, 1500, 1500, 1500});
  stage.run();
  EXPECT_NE(stage.get<std::uint16_t>("flags")[0] & flag::saturated, 0);
  EXPECT_EQ(stage.get<std::uint16_t>("flags")[1] & flag::saturated, 0);
}

TEST(Decoder, SaturationMayStayValid) {
  Harness stage("four_phase_decoder full_well=\"2000 counts\" invalidate_saturated=false");
  stage.metadata().modulation_frequency = 20e6;
  stage.put<std::uint16_t>("taps", {4, 2, 1, 1}, {2000, 1000, 1500, 1500, 1000, 2000, 1500, 1500});
  stage.run();
  EXPECT_EQ(stage.get<std::uint16_t>("flags")[0], flag::saturated);
  EXPECT_EQ(stage.get<float>("distance")[0], 0);
}

TEST(Decoder, SigmaFromPhasesUsesTheContrast) {
  Harness stage("four_phase_decoder shot_noise=\"0.5 counts\"");
  stage.camera(test::profile_of(test::camcube2().view));  // read noise 3, contrast 0.5
  stage.metadata().modulation_frequency = 20e6;
  stage.put<float>("phases", {4, 1, 1}, {800, -600, -800, 600});
  stage.run();
  const double intensity = 1000 / (2 * 0.5), sample = std::sqrt(2 * (9 + 0.5 * intensity));
  EXPECT_NEAR(stage.get<float>("sigma")[0], c_light / (4 * pi * 20e6) * sample / (std::sqrt(2) * 1000), 1e-7);
}

TEST(Decoder, LowSignalIsFlaggedAndInvalidWhenAsked) {
  for (const bool invalidate : {false, true}) {
    Harness stage(std::string("four_phase_decoder min_amplitude=\"50 counts\" invalidate_low_signal=") +
                  (invalidate ? "true" : "false"));
    stage.metadata().modulation_frequency = 20e6;
    stage.put<float>("phases", {4, 1, 2}, {49, 51, 0, 0, -49, -51, 0, 0});
    stage.run();
    const auto flags = stage.get<std::uint16_t>("flags");
    EXPECT_EQ(flags[0], flag::low_signal | (invalidate ? flag::invalid : 0));
    EXPECT_EQ(flags[1], 0);
    EXPECT_EQ(std::isnan(stage.get<float>("distance")[0]), invalidate);
  }
}

TEST(Decoder, InconsistentSamplesAreFlaggedOnly) {
  // N2 = (c0 - c1 + c2 - c3)/4 = 12 for the first, 8 for the second pixel
  const std::vector<float> phases = {1012, 1008, -12, -8, -988, -992, -12, -8};
  Harness absolute("four_phase_decoder inconsistent_above=\"10 counts\"");
  absolute.metadata().modulation_frequency = 20e6;
  absolute.put<float>("phases", {4, 1, 2}, phases);
  absolute.run();
  EXPECT_EQ(absolute.get<std::uint16_t>("flags"), (std::vector<std::uint16_t>{flag::inconsistent, 0}));
  EXPECT_FALSE(std::isnan(absolute.get<float>("distance")[0]));
  // auto: N2 has half the deviation s of a sample; 5 s/2 = 10 counts for s = 4, that is a read noise of sqrt(8)
  Harness automatic("four_phase_decoder read_noise=\"2.8284271 counts\" shot_noise=\"0 counts\"");
  automatic.metadata().modulation_frequency = 20e6;
  automatic.put<float>("phases", {4, 1, 2}, phases);
  automatic.run();
  EXPECT_EQ(automatic.get<std::uint16_t>("flags"), (std::vector<std::uint16_t>{flag::inconsistent, 0}));
  Harness off("four_phase_decoder inconsistent_above=off read_noise=\"1 counts\" shot_noise=\"0 counts\"");
  off.metadata().modulation_frequency = 20e6;
  off.put<float>("phases", {4, 1, 2}, phases);
  off.run();
  EXPECT_EQ(off.get<std::uint16_t>("flags"), (std::vector<std::uint16_t>{0, 0}));
}

TEST(Decoder, WithoutAPhaseThereIsNoDistance) {
  const float nan = std::nanf(""), infinite = std::numeric_limits<float>::infinity();
  Harness stage("four_phase_decoder");
  stage.metadata().modulation_frequency = 20e6;
  stage.put<float>("phases", {4, 1, 4}, {0, nan, infinite, 5, 0, 1, 1, 5, 0, 1, 1, 5, 0, 1, 1, 5});
  stage.run();
  for (int i = 0; i < 4; ++i) {  // no light, NaN, infinite, constant light only
    EXPECT_TRUE(std::isnan(stage.get<float>("distance")[static_cast<std::size_t>(i)])) << i;
    EXPECT_EQ(stage.get<std::uint16_t>("flags")[static_cast<std::size_t>(i)] & flag::invalid, flag::invalid) << i;
  }
}

TEST(Decoder, KeepsTheFlagsThatArrive) {
  Harness stage("four_phase_decoder min_amplitude=\"50 counts\"");
  stage.metadata().modulation_frequency = 20e6;
  stage.put<float>("phases", {4, 1, 2}, {100, 10, 0, 0, -100, -10, 0, 0});
  stage.put<std::uint16_t>("flags", {1, 2}, {flag::invalid | flag::bad_pixel, flag::user});
  stage.run();
  EXPECT_EQ(stage.get<std::uint16_t>("flags"),
            (std::vector<std::uint16_t>{flag::invalid | flag::bad_pixel, flag::user | flag::low_signal}));
  EXPECT_TRUE(std::isnan(stage.get<float>("distance")[0]));
  EXPECT_FALSE(std::isnan(stage.get<float>("distance")[1]));
}

TEST(Decoder, NeedsAFrequency) {
  Harness unknown("four_phase_decoder");
  unknown.known(TOFGRAPH_KNOWS_TIMESTAMP);
  unknown.put<float>("phases", {4, 1, 1}, {0, -100, 0, 100});
  const std::string text = message_of([&] { unknown.prepare(); });
  EXPECT_NE(text.find("modulation_frequency: 20 MHz"), std::string::npos) << text;
  Harness given("four_phase_decoder modulation_frequency=\"30 MHz\"");
  given.known(0);
  given.put<float>("phases", {4, 1, 1}, {0, -100, 0, 100});
  given.metadata().modulation_frequency = 20e6;
  given.run();
  EXPECT_NEAR(given.get<float>("distance")[0], c_light / 60e6 / 4, 2e-7) << "the parameter wins";
  Harness frame("four_phase_decoder");
  frame.put<float>("phases", {4, 1, 1}, {0, -100, 0, 100});
  EXPECT_NE(message_of([&] { frame.run(); }).find("is unknown"), std::string::npos);
}

}  // namespace
