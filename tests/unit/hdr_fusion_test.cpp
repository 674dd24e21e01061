// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: HdrFusion.ABracket*
// Rooms: plugins
// Bracketed exposures, compared with weighted means computed by hand; simulated 1:8:64 with the lowest possible noise.
#include <gtest/gtest.h>
#include <hdf5.h>
#include <tofgraph/harness.hpp>

#include "tests/program.hpp"
#include "tests/unit/cameras.hpp"
#include "tests/unit/message_of.hpp"
#include "tests/unit/raw_capture.hpp"

#include <cmath>
#include <random>

using namespace tofgraph;

namespace {

constexpr std::uint16_t invalid = 1, saturated = 2, low_signal = 8;

TEST(HdrFusion, IsTheMeanByVarianceOfWhatIsValidAndNotSaturated) {
  Harness stage("hdr_fusion frames=2");
  stage.camera("camcube2");
  const std::vector<std::uint64_t> shape = {1, 4};
  const auto put = [&](const std::vector<float>& depth, const std::vector<float>& sigma,
                       const std::vector<float>& light, const std::vector<std::uint16_t>& flags, double time) {
    stage.put<float>("depth", shape, depth);
    stage.put<float>("sigma", shape, sigma, {.of = "depth"});
    stage.put<float>("amplitude", shape, light, {.unit = "counts"});
    stage.put<std::uint16_t>("flags", shape, flags);
    stage.metadata().integration_time = time;
    stage.run();
  };
  put({1.00F, 2.0F, 3.0F, NAN}, {0.01F, 0.01F, 0.01F, NAN}, {100, 100, 100, 0}, {low_signal, 0, 0, invalid}, 1e-3);
  put({1.03F, 2.5F, 3.3F, NAN}, {0.02F, 0.01F, 0.01F, NAN}, {400, 0, 400, 0}, {0, saturated, 0, saturated | invalid},
      4e-3);
  const auto depth = stage.get<float>("depth"), sigma = stage.get<float>("sigma"),
             light = stage.get<float>("amplitude");
  const auto flags = stage.get<std::uint16_t>("flags");
  const double weights = 1 / 1e-4 + 1 / 4e-4;
  EXPECT_NEAR(depth[0], (1.00 / 1e-4 + 1.03 / 4e-4) / weights, 1e-6);
  EXPECT_NEAR(sigma[0], 1 / std::sqrt(weights), 1e-7);
  EXPECT_NEAR(light[0], 400, 1e-3) << "100 counts in a fourth of the time";
  EXPECT_EQ(flags[0], low_signal);
  EXPECT_FLOAT_EQ(depth[1], 2) << "the other is saturated";
  EXPECT_FLOAT_EQ(sigma[1], 0.01F);
  EXPECT_EQ(flags[1], 0);
  EXPECT_NEAR(depth[2], 3.15, 1e-6);
  EXPECT_TRUE(std::isnan(depth[3]));
  EXPECT_EQ(flags[3], invalid | saturated);
}

TEST(HdrFusion, DistancesAtTheEndOfTheUnambiguousRangeStayThere) {
  struct Case {
    float first, second;
    double mean;  // m
  };
  constexpr double length = 7.49481145;  // m, of the range
  for (const auto& [first, second, mean] : {Case{7.490F, 0.004F, (7.490 + length + 0.004) / 2},
                                            {0.004F, 7.490F, (7.490 + length + 0.004) / 2},
                                            {7.490F, 0.010F, (7.490 - length + 0.010) / 2},
                                            {0.010F, 7.490F, (7.490 - length + 0.010) / 2}}) {
    Harness stage("hdr_fusion");
    stage.camera("camcube2");
    for (const auto& [distance, time] : {std::pair{first, 1e-3}, {second, 2e-3}}) {
      stage.put<float>("distance", {1, 1}, {distance});
      stage.put<float>("sigma", {1, 1}, {0.01F}, {.of = "distance"});
      stage.metadata().integration_time = time;
      stage.run();
    }
    EXPECT_NEAR(stage.get<float>("distance")[0], mean, 1e-5) << first << " m first";
  }
}

/// Fuses the distances of two frames.
double fused(const std::string& camera, double frequency, float first, float second) {
  Harness stage("hdr_fusion");
  stage.camera(camera);
  for (const auto& [distance, time] : {std::pair{first, 1e-3}, {second, 2e-3}}) {
    stage.put<float>("distance", {1, 1}, {distance});
    stage.put<float>("sigma", {1, 1}, {0.01F}, {.of = "distance"});
    stage.metadata().integration_time = time;
    stage.metadata().modulation_frequency = frequency;
    stage.run();
  }
  return double{stage.get<float>("distance")[0]};
}

TEST(HdrFusion, DistancesRepeatAtTheRangeOfTheFrames) {
  constexpr double range = 299792458.0 / 60e6;  // m
  EXPECT_NEAR(fused("camcube2", 30e6, 4.990F, 0.004F), (4.990 + range + 0.004) / 2, 1e-5)
      << "the nominal range of the camera is 7.49 m";
  EXPECT_NEAR(fused("camcube2", 15e6, 9.00F, 9.02F), 9.01, 1e-5);
  EXPECT_NEAR(fused("camcube2", 20e6, 7.49F, 7.53F), 7.51, 1e-5) << "corrected by an offset";
  const std::vector<tofgraph_exposure> exposures = {{0, 80e6}, {2, 80e6}, {4, 80e6}, {0, 16e6}, {2, 16e6}, {4, 16e6}};
  test::Camera several(1, 1, 12.8e-3, 40e-6, {{"lamp", {0, 0, 0}, 1}});
  several.view.exposures = exposures.data();
  several.view.exposure_size = sizeof(tofgraph_exposure);
  several.view.exposure_count = exposures.size();
  several.view.modulation_frequency = 80e6;
  const std::string profile = test::profile_of(several.view);
  EXPECT_NEAR(fused(profile, 80e6, 5.00F, 5.02F), 5.01, 1e-5) << "unwrapped by the decoder";
  constexpr double common = 299792458.0 / 32e6;  // m
  EXPECT_NEAR(fused(profile, 80e6, 9.366F, 0.001F), (9.366 + common + 0.001) / 2, 1e-5);
}

/// The amplitude is that of the longest time, so the frame states that time.
TEST(HdrFusion, TheFrameStatesTheTimeOfItsAmplitude) {
  const tests::TemporaryFolder folder;
  tests::write_text(folder.path() / "s.yaml",
                    "scene: 1\ncamera: camcube2\noutput: taps\nobjects: [{type: board, distance: 900 mm}]\n"
                    "sequence:\n  - {key: integration_time, values: [4 ms, 0.5 ms]}\n");
  const tests::Outcome outcome = tests::shell(
      "$TOFGRAPH run \"simulator scene=s.yaml ! four_phase_decoder ! hdr_fusion ! capture_writer path=hdr.h5\"",
      folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto times = tests::raw_values<double>(folder.path() / "hdr.h5", "/frames/integration_time_s");
  ASSERT_EQ(times.size(), 1U);
  EXPECT_NEAR(times[0], 4e-3, 1e-9);
}

/// Two frequencies with a combined range of 15 m: every true distance is recovered as the inverse-variance mean.
TEST(HdrFusion, DistancesOfAlternatingFrequenciesAreUnwrapped) {
  constexpr double light_speed = 299792458.0, f[] = {60e6, 50e6}, sigma[] = {0.004, 0.006};
  constexpr std::size_t n = 400;
  std::mt19937 random(3);
  std::normal_distribution<double> noise;
  std::vector<double> truth;
  for (std::size_t i = 0; i < n; ++i) truth.push_back(0.1 + 14.8 * static_cast<double>(i) / n);
  Harness stage("hdr_fusion by=frequency");
  stage.camera("camcube2");
  std::vector<double> weighted(n);
  const double weights = 1 / (sigma[0] * sigma[0]) + 1 / (sigma[1] * sigma[1]);
  for (std::size_t k = 0; k < 2; ++k) {
    std::vector<float> wrapped;
    for (std::size_t i = 0; i < n; ++i) {
      const double error = sigma[k] * noise(random), period = light_speed / (2 * f[k]);
      weighted[i] += error / (sigma[k] * sigma[k] * weights);
      wrapped.push_back(static_cast<float>(std::fmod(truth[i] + error + period, period)));
    }
    std::vector<std::uint16_t> flags(n, 0);
    if (k == 1) flags[7] = saturated;
    stage.put<float>("distance", {1, n}, wrapped);
    stage.put<float>("sigma", {1, n}, std::vector<float>(n, static_cast<float>(sigma[k])), {.of = "distance"});
    stage.put<std::uint16_t>("flags", {1, n}, flags);
    stage.metadata().modulation_frequency = f[k];
    EXPECT_EQ(stage.run(), k == 1);
  }
  const auto distance = stage.get<float>("distance"), deviation = stage.get<float>("sigma");
  const auto flags = stage.get<std::uint16_t>("flags");
  EXPECT_EQ(stage.applied("distance"), "hdr_fusion unwrapped") << "later means over frames depend on it";
  for (std::size_t i = 0; i < n; ++i) {
    if (i == 7) {
      EXPECT_EQ(flags[i], saturated | invalid);
      EXPECT_TRUE(std::isnan(distance[i]));
      continue;
    }
    ASSERT_NEAR(distance[i], truth[i] + weighted[i], 1e-5) << i;
    ASSERT_NEAR(deviation[i], 1 / std::sqrt(weights), 1e-7);
    ASSERT_EQ(flags[i], 0);
  }
}

TEST(HdrFusion, DepthsAreNotUnwrapped) {
  EXPECT_NE(message_of([] {
              Harness stage("hdr_fusion by=frequency");
              stage.put<float>("depth", {1, 1}, {1.0F});
              stage.put<float>("sigma", {1, 1}, {0.01F}, {.of = "depth"});
              stage.prepare();
            }).find("before the distance model"),
            std::string::npos);
}

TEST(HdrFusion, RefusesWhatIsNoBracket) {
  Harness stage("hdr_fusion");
  stage.camera("camcube2");
  const auto put = [&] {
    stage.put<float>("depth", {1, 1}, {1.0F});
    stage.put<float>("sigma", {1, 1}, {0.01F}, {.of = "depth"});
    stage.metadata().integration_time = 1e-3;
    stage.run();
  };
  put();
  EXPECT_NE(message_of(put).find("came twice in a bracket of 2"), std::string::npos);
}

/// No pixel that one exposure shows well is lost, and the noise is that of all good exposures combined.
TEST(HdrFusion, ABracketOf1To8To64LosesNoPixelThatOneExposureShows) {
  const tests::TemporaryFolder folder;
  const auto run = [&](const std::string& command) {
    const tests::Outcome outcome = tests::shell("$TOFGRAPH " + command, folder.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  };
  std::string scene =
      "scene: 1\ncamera: camcube2\noutput: taps\nobjects: [{type: board, distance: 900 mm, reflectivity: 0.8}]\n"
      "sequence:\n  - {key: temperature, values: [";
  for (int frame = 0; frame < 30; ++frame) scene += (frame > 0 ? ", " : "") + std::to_string(20 + frame) + " degC";
  scene += "]}\n  - {key: integration_time, values: [0.5 ms, 4 ms, 32 ms]}\n";
  tests::write_text(folder.path() / "s.yaml", scene);
  run("run \"simulator scene=s.yaml ! four_phase_decoder ! capture_writer path=single.h5\"");
  run("run \"capture_reader file=single.h5 ! hdr_fusion frames=3 ! capture_writer path=hdr.h5\"");
  const auto single = tests::raw_values<float>(folder.path() / "single.h5", "/frames/sigma"),
             sigma = tests::raw_values<float>(folder.path() / "hdr.h5", "/frames/sigma"),
             distance = tests::raw_values<float>(folder.path() / "hdr.h5", "/frames/distance");
  const auto flags = tests::raw_values<std::uint16_t>(folder.path() / "single.h5", "/frames/flags"),
             joined = tests::raw_values<std::uint16_t>(folder.path() / "hdr.h5", "/frames/flags");
  constexpr std::size_t pixels = 204 * 204, count = 30;
  ASSERT_EQ(distance.size(), count * pixels);
  double ratio = 0, used = 0;
  std::size_t saturated_pixels = 0;
  for (std::size_t p = 0; p < pixels; p += 97) {
    double sum = 0, squares = 0, predicted = 0;
    for (std::size_t f = 0; f < count; ++f) {
      double weight = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t at = (3 * f + k) * pixels + p;
        saturated_pixels += (flags[at] & saturated) != 0 ? 1 : 0;
        if ((flags[at] & (invalid | saturated)) == 0) weight += 1 / (double{single[at]} * single[at]);
      }
      const std::size_t at = f * pixels + p;
      ASSERT_EQ((joined[at] & invalid) != 0, weight == 0) << p;
      if (weight == 0) continue;
      EXPECT_NEAR(sigma[at], 1 / std::sqrt(weight), 1e-4 / std::sqrt(weight));
      sum += double{distance[at]};
      squares += double{distance[at]} * distance[at];
      predicted += 1 / weight;
    }
    ratio += (squares - sum * sum / count) / (count - 1) / (predicted / count);
    used += 1;
  }
  EXPECT_GT(saturated_pixels, 0U) << "the longest time is too long for this board";
  EXPECT_NEAR(std::sqrt(ratio / used), 1, 0.05) << "spread over the frames against the best that is possible";
}

}  // namespace
