// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: NoiseModel.*Simulated*
// Rooms: plugins
// The stated sigma, compared with the temporal standard deviation of simulated recordings and with closed forms.
#include <gtest/gtest.h>
#include <hdf5.h>
#include <tofgraph/harness.hpp>

#include "tests/program.hpp"
#include "tests/unit/cameras.hpp"
#include "tests/unit/message_of.hpp"
#include "tests/unit/raw_capture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

namespace tofgraph {
namespace {

constexpr double speed_of_light = 299792458.0;

TEST(NoiseModel, ProfileFollowsTheClosedForm) {
  Harness stage(
      "noise_model mode=profile read_noise='3 counts' shot_noise='0.5 counts' contrast=0.4 background='2000 counts/s'");
  stage.put<float>("range", {1, 3}, {1, 2, 3});
  stage.put<float>("amplitude", {1, 3}, {100, 1000, 0}, {.unit = "counts"});
  stage.metadata().integration_time = 5e-3;
  stage.metadata().modulation_frequency = 20e6;
  stage.run();
  const auto sigma = stage.get<float>("sigma");
  for (const auto& [i, a] : {std::pair{0U, 100.0}, {1U, 1000.0}}) {
    const double tap = 9 + 0.5 * (a / 0.8 + 10);
    EXPECT_NEAR(sigma[i], speed_of_light / (4 * M_PI * 20e6) * std::sqrt(tap) / a, 1e-6);
  }
  EXPECT_TRUE(std::isnan(sigma[2])) << "without light nothing is known";
  EXPECT_EQ(stage.of("sigma"), "range");
}

/// As after a decoder whose parameter replaced the frequency of the exposures.
TEST(NoiseModel, TheOneFrequencyIsThatOfTheFrame) {
  const std::vector<tofgraph_exposure> exposures = {{0, 30e6}, {M_PI / 2, 30e6}, {M_PI, 30e6}, {3 * M_PI / 2, 30e6}};
  test::Camera camera(3, 1, 12.8e-3, 40e-6, {{"lamp", {0, 0, 0}, 1}});
  camera.view.exposures = exposures.data();
  camera.view.exposure_size = sizeof(tofgraph_exposure);
  camera.view.exposure_count = exposures.size();
  camera.view.modulation_frequency = 30e6;
  Harness stage("noise_model mode=profile read_noise='3 counts' shot_noise='0 counts'");
  stage.camera(test::profile_of(camera.view));
  stage.put<float>("range", {1, 3}, {1, 2, 3});
  stage.put<float>("amplitude", {1, 3}, {100, 100, 100}, {.unit = "counts"});
  stage.metadata().modulation_frequency = 20e6;
  stage.run();
  EXPECT_NEAR(stage.get<float>("sigma")[0], speed_of_light / (4 * M_PI * 20e6) * 3 / 100, 1e-6);
}

TEST(NoiseModel, DepthsHaveTheCosineOfTheirRay) {
  Harness stage("noise_model mode=profile read_noise='3 counts' shot_noise='0 counts'");
  stage.camera("camcube2");
  stage.put<float>("depth", {204, 204}, std::vector<float>(204 * 204, 1));
  stage.put<float>("amplitude", {204, 204}, std::vector<float>(204 * 204, 100), {.unit = "counts"});
  stage.metadata().modulation_frequency = 20e6;
  stage.run();
  const double expected = speed_of_light / (4 * M_PI * 20e6) * 3 / 100;
  EXPECT_NEAR(stage.get<float>("sigma")[0], expected * double{stage.camera().rays[2]}, 1e-6);
}

/// Noise of 2 mm on the left, 6 mm on the right, on a slope with steps.
std::vector<float> noisy_wall(std::uint64_t seed, std::size_t rows = 64, std::size_t columns = 128) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise;
  std::vector<float> image;
  for (std::size_t i = 0; i < rows * columns; ++i) {
    const std::size_t c = i % columns;
    const double step = c % 64 < 32 ? 0 : 0.5;
    image.push_back(static_cast<float>(2 + 0.004 * static_cast<double>(c) + step +
                                       (c < columns / 2 ? 0.002 : 0.006) * noise(random)));
  }
  return image;
}

/// Medians of sigma over the left and the right half.
std::array<float, 2> halves(const std::vector<float>& sigma) {
  std::array<std::vector<float>, 2> values;
  for (std::size_t i = 0; i < sigma.size(); ++i) values[i % 128 < 64 ? 0 : 1].push_back(sigma[i]);
  for (auto& half : values) std::ranges::sort(half);
  return {values[0][values[0].size() / 2], values[1][values[1].size() / 2]};
}

TEST(NoiseModel, WithoutAmplitudeEachTileHasItsOwn) {
  Harness spatial("noise_model mode=spatial");
  spatial.put<float>("depth", {64, 128}, noisy_wall(1));
  spatial.run();
  const auto [left, right] = halves(spatial.get<float>("sigma"));
  EXPECT_NEAR(left, 0.002, 0.0003);
  EXPECT_NEAR(right, 0.006, 0.0009);

  Harness frames("noise_model mode=frames");
  frames.put<float>("depth", {64, 128}, noisy_wall(1));
  EXPECT_FALSE(frames.run()) << "the first frame has none to be compared with";
  frames.put<float>("depth", {64, 128}, noisy_wall(2));
  EXPECT_TRUE(frames.run());
  const auto [still_left, still_right] = halves(frames.get<float>("sigma"));
  EXPECT_NEAR(still_left, 0.002, 0.0002);
  EXPECT_NEAR(still_right, 0.006, 0.0006);
}

TEST(NoiseModel, ATileOfEqualValuesHasTheNoiseOfTheFrame) {
  Harness stage("noise_model mode=spatial");
  std::vector<float> wall = noisy_wall(1);
  for (std::size_t row = 0; row < 16; ++row)
    std::fill_n(wall.begin() + static_cast<std::ptrdiff_t>(128 * row), 16, 2.0F);
  stage.put<float>("depth", {64, 128}, wall);
  stage.run();
  const auto sigma = stage.get<float>("sigma");
  for (std::size_t row = 0; row < 16; ++row) {
    EXPECT_GT(sigma[128 * row], 0.002F);
    EXPECT_LT(sigma[128 * row], 0.006F);
  }
}

/// Expects that frames are compared only with those of the same setting: every second one has another, and is off by
/// 0.3 m. @param set sets it in the metadata of a frame
template <class Set> void expect_comparison_within_settings(const Set& set) {
  Harness stage("noise_model mode=frames");
  std::size_t left = 0;
  for (std::uint64_t k = 0; k < 6; ++k) {
    const bool other = k % 2 == 1;
    std::vector<float> image = noisy_wall(k);
    if (other)
      for (float& z : image) z += 0.3F;
    stage.put<float>("depth", {64, 128}, image);
    set(stage.metadata(), other);
    if (!stage.run()) continue;
    ++left;
    EXPECT_LT(halves(stage.get<float>("sigma"))[0], 0.0025F);
  }
  EXPECT_EQ(left, 4U);
}

TEST(NoiseModel, FramesOfOneIntegrationTimeAreCompared) {
  expect_comparison_within_settings(
      [](auto& metadata, bool other) { metadata.integration_time = other ? 4e-3 : 1e-3; });
}

TEST(NoiseModel, FramesOfOneFrequencyAreCompared) {
  expect_comparison_within_settings([](auto& metadata, bool other) {
    metadata.integration_time = 1e-3;
    metadata.modulation_frequency = other ? 60e6 : 50e6;
  });
}

TEST(NoiseModel, SaysWhatIsMissing) {
  const auto message = [](const std::string& options, bool amplitude, float rounding = 0) {
    return message_of([&] {
      Harness stage("noise_model " + options);
      std::vector<float> image = noisy_wall(1);
      if (rounding > 0)
        for (float& z : image) z = std::round(z / rounding) * rounding;
      stage.put<float>("depth", {64, 128}, image);
      if (amplitude) stage.put<float>("amplitude", {64, 128}, std::vector<float>(64 * 128, 100), {.unit = "counts"});
      stage.run();
    });
  };
  EXPECT_NE(message("mode=profile", false).find("needs the amplitude"), std::string::npos);
  EXPECT_NE(message("mode=profile", true).find("needs read_noise and shot_noise"), std::string::npos);
  EXPECT_NE(message("mode=profile read_noise='3 counts' shot_noise='1 counts'", true).find("contrast: 0.5"),
            std::string::npos);
  EXPECT_NE(message("mode=null_channel", true).find("needs the raw images"), std::string::npos);
  EXPECT_NE(message("mode=spatial", true, 0.5F).find("rounded more coarsely than the noise"), std::string::npos);
  EXPECT_EQ(message("mode=spatial", true), "no error");
  EXPECT_NE(message("", true).find("mode"), std::string::npos);
}

/// Ratio of stated to true sigma (temporal standard deviation) in five groups of pixels, from darkest to brightest.
std::vector<double> ratios(const std::filesystem::path& truth, const std::filesystem::path& file, std::size_t skipped) {
  constexpr std::size_t pixels = 204 * 204, frames = 60;
  const auto distance = tests::raw_values<float>(truth, "/frames/distance"),
             amplitude = tests::raw_values<float>(truth, "/frames/amplitude"),
             sigma = tests::raw_values<float>(file, "/frames/sigma");
  EXPECT_EQ(sigma.size(), (frames - skipped) * pixels);
  std::vector<std::array<double, 3>> all;  // amplitude, true, stated variance
  for (std::size_t p = 0; p < pixels; ++p) {
    double mean = 0, squares = 0, light = 0, stated = 0;
    for (std::size_t f = 0; f < frames; ++f) {
      const double d = distance[f * pixels + p];
      mean += d / frames, squares += d * d / frames, light += double{amplitude[f * pixels + p]} / frames;
      if (f >= skipped)
        stated += std::pow(double{sigma[(f - skipped) * pixels + p]}, 2) / static_cast<double>(frames - skipped);
    }
    all.push_back({light, (squares - mean * mean) * frames / (frames - 1), stated});
  }
  std::ranges::sort(all);
  std::vector<double> result;
  for (std::size_t group = 0; group < 5; ++group) {
    double real = 0, stated = 0;
    for (std::size_t i = group * pixels / 5; i < (group + 1) * pixels / 5; ++i) real += all[i][1], stated += all[i][2];
    result.push_back(std::sqrt(stated / real));
  }
  return result;
}

/// A chessboard in front of a slanted wall: amplitudes from 300 to 5000 counts.
TEST(NoiseModel, IsTheSpreadOfSimulatedRecordings) {
  const tests::TemporaryFolder folder;
  const auto run = [&](const std::string& line) {
    const tests::Outcome outcome = tests::shell("$TOFGRAPH run \"" + line + "\"", folder.path());
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  };
  tests::write_text(folder.path() / "s.yaml",
                    "scene: 1\ncamera: camcube2\noutput: taps\nframes: 60\nintegration_time: 1 ms\nobjects:\n"
                    "  - {type: board, distance: 1500 mm, tilt_y: 40 deg, reflectivity: 0.5}\n"
                    "  - {type: chessboard, distance: 900 mm, columns: 4, rows: 3, square: 60 mm, tilt_x: 10 deg}\n");
  run("simulator scene=s.yaml ! four_phase_decoder ! capture_writer path=s.h5");
  const std::string decoded = "capture_reader file=s.h5 channels=[distance,amplitude,flags] ! noise_model ";
  run(decoded + "mode=profile ! capture_writer path=profile.h5");
  run(decoded + "mode=frames ! capture_writer path=frames.h5");
  run(decoded + "mode=spatial ! capture_writer path=spatial.h5");
  run("capture_reader file=s.h5 channels=[taps,distance,amplitude,flags] ! noise_model mode=null_channel ! "
      "capture_writer path=null_channel.h5");
  for (const std::string mode : {"profile", "null_channel", "frames", "spatial"}) {
    const auto found = ratios(folder.path() / "s.h5", folder.path() / (mode + ".h5"), mode == "frames" ? 1 : 0);
    std::printf("%-13s stated / true from dark to bright:", mode.c_str());
    for (const double ratio : found) {
      std::printf(" %.3f", ratio);
      EXPECT_NEAR(ratio, 1, 0.02) << mode;
    }
    std::printf("\n");
  }
}

/// The denoisers' default strength works with a recording that contains only lengths.
TEST(NoiseModel, DenoisersWorkOnSimulatedDepthsAlone) {
  const tests::TemporaryFolder folder;
  tests::write_text(folder.path() / "s.yaml",
                    "scene: 1\ncamera: camcube2\noutput: taps\nframes: 2\n"
                    "objects: [{type: board, distance: 1500 mm, tilt_y: 40 deg, reflectivity: 0.5}]\n");
  const auto run = [&](const std::string& line) {
    return tests::shell("$TOFGRAPH run \"" + line + "\"", folder.path());
  };
  ASSERT_EQ(run("simulator scene=s.yaml ! four_phase_decoder ! optimized_bistatic ! capture_writer path=s.h5 "
                "channels=[depth,flags]")
                .exit_code,
            0);
  EXPECT_EQ(run("capture_reader file=s.h5 ! bilateral ! null").exit_code, 2) << "nothing states the noise";
  const auto outcome = run("capture_reader file=s.h5 ! noise_model mode=spatial ! bilateral ! null");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
}

}  // namespace
}  // namespace tofgraph
