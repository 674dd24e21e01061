// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Noise.ReadAndShot*:Noise.TheMask*:Noise.ALaw*
// Rooms: calibration
// The calibration noise, compared with random taps: Poisson-distributed electrons, Gaussian read noise.
#include <hdf5.h>

#include "tests/plain_boards.hpp"
#include "tests/program.hpp"

#include "calibration/noise.hpp"
#include "io/calibration.hpp"

#include <algorithm>
#include <array>
#include <numbers>
#include <regex>

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

constexpr double electrons_per_count = 50, read_noise = 4, range = 7.4948114;  // counts; m at 20 MHz
constexpr std::size_t frames = 16;

class Noise : public testing::Test {
 protected:
  /// Random counts of a tap for a mean level, from electrons and the converter. Constructed once per level, since that
  /// takes as long as several draws.
  class Tap {
   public:
    explicit Tap(double level) : level_(level), electrons_(level * electrons_per_count) {}
    std::uint16_t operator()(std::mt19937_64& random, std::normal_distribution<double>& read, double more = 1) {
      const double counts = level_ + more * (electrons_(random) / electrons_per_count - level_ + read(random));
      return static_cast<std::uint16_t>(std::clamp(std::lround(counts), 0L, 65535L));
    }

   private:
    double level_;
    std::poisson_distribution<int> electrons_;
  };

  /// Taps of a scene at one distance, brighter to the right: contrast 0.5, plus ambient light.
  /// @param more noise factor of all pixels
  void record(const std::string& name, double amplitude, double distance, const std::string& serial = {},
              double more_in_two_pixels = 1, double more = 1) {
    std::vector<std::uint16_t> taps;
    taps.reserve(frames * 8 * plain_pixels);
    std::normal_distribution<double> read(0, read_noise);
    std::vector<std::vector<Tap>> images;  // for each tap of each exposure: its columns, followed by the dark pixel
    for (std::size_t k = 0; k < 4; ++k) {
      const double phase = 2 * std::numbers::pi * distance / range + static_cast<double>(k) * std::numbers::pi / 2;
      for (const int sign : {1, -1}) {
        const auto level = [&](std::size_t column) {
          const double a = amplitude * (0.7 + 0.6 * static_cast<double>(column) / plain_side);
          return a + 60 + sign * a / 2 * std::cos(phase);
        };
        std::vector<Tap>& columns = images.emplace_back();
        for (std::size_t column = 0; column < plain_side; ++column) columns.emplace_back(level(column));
        columns.emplace_back(level(dark % plain_side) / 2);
      }
    }
    for (std::size_t f = 0; f < frames; ++f) {
      for (std::vector<Tap>& columns : images) {
        for (std::size_t i = 0; i < plain_pixels; ++i) {
          if (i == stuck)
            taps.push_back(777);
          else if (i == dark)
            taps.push_back(columns.back()(random_, read));
          else
            taps.push_back(columns[i % plain_side](random_, read, more * (i == noisy ? more_in_two_pixels : 1)));
        }
      }
    }
    RawCapture capture(folder.path() / name);
    if (!serial.empty()) capture.text("serial", serial);
    capture.head(plain_side, plain_side, 1, "tofgraph-capture", "camcube2");
    capture.dataset("taps", {frames, 4, 2, plain_side, plain_side}, taps, {1, 4, 2, plain_side, plain_side});
    capture.metadata(frames, 1e-3);
  }

  void campaign(const std::vector<std::string>& captures) {
    std::string text = "campaign: 1\ncamera: camcube2\nconditions:\n";
    for (std::size_t i = 0; i < captures.size(); ++i)
      text += "  - {id: c" + std::to_string(i) + ", capture: " + captures[i] +
              ", board: {distance: 1 m}, integration_time: " + std::to_string(i + 1) + " ms}\n";
    write_text(folder.path() / "campaign.yaml", text);
  }

  Outcome run(const std::string& command) const { return shell("\"$TOFGRAPH\" " + command, folder.path()); }

  static constexpr std::size_t stuck = 5000, dark = 20000, noisy = 30000;
  std::mt19937_64 random_{3};
  TemporaryFolder folder;
};

TEST_F(Noise, ReadAndShotNoiseAreRightToTwoPercentAndSigmaToThreeAtEveryAmplitude) {
  const std::array<double, 5> amplitudes = {40, 150, 500, 1500, 5000};
  std::vector<std::string> names;
  for (const double a : amplitudes) {
    names.push_back("a" + std::to_string(static_cast<int>(a)) + ".h5");
    record(names.back(), a, 2, {}, 3);
  }
  campaign(names);
  const Outcome outcome = run("calibrate noise campaign.yaml -o n.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  io::CalibrationReader file(folder.path() / "n.yaml", "noise", "camcube2");
  const io::Calibrated read = file.need("read_noise", "counts", 1, ""), shot = file.need("shot_noise", "counts", 1, "");
  EXPECT_NEAR(read.value[0], read_noise, 0.02 * read_noise);
  EXPECT_NEAR(shot.value[0], 1 / electrons_per_count, 0.02 / electrons_per_count);
  std::printf("read noise %.4f of %.1f counts, shot noise %.5f of %.5f\n", read.value[0], read_noise, shot.value[0],
              1 / electrons_per_count);
  // Exactly three pixels deviate from the others.
  const std::vector<double> bad = raw_values<double>(folder.path() / "n.maps.h5", "bad");
  EXPECT_EQ(bad[stuck], 6) << "stuck, and another response";
  EXPECT_EQ(bad[dark], 4);
  EXPECT_EQ(bad[noisy], 1);
  EXPECT_EQ(std::ranges::count_if(bad, [](double b) { return b != 0; }), 3);
  // Noise after decoding, compared with the standard deviation of distances decoded here.
  for (std::size_t c = 0; c < amplitudes.size(); ++c) {
    const Outcome decoded = run("run \"capture_reader file=" + names[c] +
                                " ! four_phase_decoder calibration=n.yaml modulation_frequency=20MHz ! capture_writer "
                                "path=d.h5 overwrite=true\"");
    ASSERT_EQ(decoded.exit_code, 0) << decoded.err;
    const auto taps = raw_values<std::uint16_t>(folder.path() / names[c], "/frames/taps");
    const auto sigma = raw_values<float>(folder.path() / "d.h5", "/frames/sigma");
    double square = 0, told = 0, count = 0;
    for (std::size_t i = 0; i < plain_pixels; ++i) {
      if (bad[i] != 0) continue;
      double sum = 0, squares = 0;
      for (std::size_t f = 0; f < frames; ++f) {
        const auto at = [&](std::size_t k, std::size_t t) {
          return static_cast<double>(taps[((f * 4 + k) * 2 + t) * plain_pixels + i]);
        };
        const auto sample = [&](std::size_t k) { return at(k, 0) - at(k, 1); };
        const double turn = 2 * std::numbers::pi * 2 / range;  // around the true distance, so that nothing wraps
        const double x = sample(0) - sample(2), y = sample(3) - sample(1);
        const double d = std::atan2(y * std::cos(turn) - x * std::sin(turn), x * std::cos(turn) + y * std::sin(turn));
        sum += d;
        squares += d * d;
        told += std::pow(sigma[f * plain_pixels + i], 2) / frames;
      }
      square += (squares - sum * sum / frames) / (frames - 1) * std::pow(range / (2 * std::numbers::pi), 2);
      count += 1;
    }
    std::printf("amplitude %.0f: sigma told %.4f mm, measured %.4f mm\n", amplitudes[c], 1e3 * std::sqrt(told / count),
                1e3 * std::sqrt(square / count));
    EXPECT_NEAR(std::sqrt(told / square), 1, 0.03) << amplitudes[c];
  }
}

TEST_F(Noise, TheMaskFlagsWhatIsBad) {
  record("a.h5", 300, 2);
  record("b.h5", 900, 2);
  record("c.h5", 2700, 2);
  campaign({"a.h5", "b.h5", "c.h5"});
  ASSERT_EQ(run("calibrate noise campaign.yaml -o n.yaml").exit_code, 0);
  write_text(
      folder.path() / "p.yaml",
      "pipeline: 1\ncamera: camcube2\nnodes:\n  - {stage: capture_reader, file: a.h5}\n"
      "  - {stage: four_phase_decoder, calibration: n.yaml, modulation_frequency: 20 MHz}\n"
      "  - {stage: mask, bad_pixels: {file: n.maps.h5, dataset: bad}}\n  - {stage: capture_writer, path: m.h5}\n");
  const Outcome outcome = run("run p.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto flags = raw_values<std::uint16_t>(folder.path() / "m.h5", "/frames/flags");
  const auto distance = raw_values<float>(folder.path() / "m.h5", "/frames/distance");
  constexpr std::uint16_t bad_and_invalid = 1024 | 1;
  EXPECT_EQ(flags[stuck] & bad_and_invalid, bad_and_invalid);
  EXPECT_TRUE(std::isnan(distance[stuck]));
  EXPECT_EQ(flags[stuck + 1] & bad_and_invalid, 0);
}

// Light that flickers more in some conditions than in others: no law of the counts predicts the noise of a condition
// from the others; the profile contains the root mean square.
TEST_F(Noise, ALawThatDoesNotPredictOtherConditionsIsNotWrittenUnlessForced) {
  std::vector<std::string> names;
  const double more[] = {1, 8, 1, 8};
  for (std::size_t i = 0; i < std::size(more); ++i) {
    names.push_back("f" + std::to_string(i) + ".h5");
    record(names.back(), 400 + 200 * static_cast<double>(i), 2, {}, 1, more[i]);
  }
  campaign(names);
  write_text(folder.path() / "known.yaml",
             std::regex_replace(read_text(TOFGRAPH_SOURCE_DIR "/devices/profiles/camcube2.yaml"),
                                std::regex("\n(read|shot)_noise: [^\n]*"), "") +
                 "read_noise: 22.8 counts\nshot_noise: 0.65 counts\n");
  const std::string text = read_text(folder.path() / "campaign.yaml");
  write_text(folder.path() / "campaign.yaml",
             std::regex_replace(text, std::regex("camera: camcube2"), "camera: ./known.yaml"));
  const Outcome refused = run("calibrate noise campaign.yaml -o n.yaml");
  EXPECT_EQ(refused.exit_code, 1) << refused.err;
  EXPECT_NE(refused.err.find("does not improve held-out conditions"), std::string::npos) << refused.err;
  EXPECT_FALSE(fs::exists(folder.path() / "n.yaml"));
  const Outcome forced = run("calibrate noise campaign.yaml -o n.yaml --force");
  EXPECT_EQ(forced.exit_code, 0) << forced.err;
}

/// Half of the conditions have less noise than the others predict, the others more: the ratios of 0.73 and 1.27 have a
/// root mean square of 1.04.
TEST(HeldOutNoise, ErrorsOfBothSignsDoNotCancel) {
  constexpr std::size_t side = 32, pixels = side * side;
  constexpr double metres_per_radian = range / (2 * std::numbers::pi);
  const std::array<double, 4> factors = {0.6, 1.4, 0.6, 1.4};  // of the variance
  calibration::NoiseData data{
      .rows = side, .columns = side, .modulation_frequency = 20e6, .listed = std::vector<std::uint8_t>(pixels)};
  for (std::size_t c = 0; c < factors.size(); ++c) {
    calibration::NoiseCondition condition{
        .index = c, .integration_time = 1e-3 * static_cast<double>(c + 1), .frames = frames};
    calibration::PixelNoise& p = condition.pixels;
    p.use.assign(pixels, calibration::PixelUse::good);
    p.frozen.assign(pixels, 0);
    p.samples = 8 * calibration::PixelNoise::freedom(frames);
    p.images = 8;
    for (std::size_t i = 0; i < pixels; ++i) {
      const double level = 100 + 900 * static_cast<double>(i) / pixels,
                   variance = factors[c] * (read_noise * read_noise + level / electrons_per_count);
      p.level.push_back(static_cast<float>(level));
      p.amplitude.push_back(static_cast<float>(level));
      p.variance.push_back(static_cast<float>(variance));
      p.distance_variance.push_back(
          static_cast<float>(variance * metres_per_radian * metres_per_radian / (level * level)));
    }
    data.conditions.push_back(std::move(condition));
  }
  const double low = std::log(0.6 / (3.4 / 3)) / 2, high = std::log(1.4 / (2.6 / 3)) / 2;  // ln ratio
  EXPECT_NEAR(calibration::fit_noise(data, nullptr).error, std::sqrt((low * low + high * high) / 2), 1e-3);
}

TEST_F(Noise, WhatCannotBeUsedIsSaid) {
  record("a.h5", 300, 2, "C7");
  record("b.h5", 900, 2, "C8");
  campaign({"a.h5", "b.h5"});
  const Outcome serials = run("calibrate noise campaign.yaml -o n.yaml");
  EXPECT_EQ(serials.exit_code, 2);
  EXPECT_NE(serials.err.find("campaign.yaml:5:5: error: the capture is of the camera with the serial C8"),
            std::string::npos)
      << serials.err;
  write_distances(folder.path() / "d.h5", {std::vector<float>(plain_pixels, 1)}, std::vector<float>(plain_pixels, 500),
                  1e-3);
  campaign({"d.h5"});
  const Outcome single = run("calibrate noise campaign.yaml -o n.yaml");
  EXPECT_EQ(single.exit_code, 2);
  EXPECT_NE(single.err.find("two or more of each condition"), std::string::npos) << single.err;
  std::vector<std::vector<float>> same(4, std::vector<float>(plain_pixels));
  std::normal_distribution<float> noise(1, 0.01F);
  for (auto& frame : same) {
    for (float& value : frame) value = noise(random_);
  }
  write_distances(folder.path() / "d.h5", same, std::vector<float>(plain_pixels, 500), 1e-3);
  const Outcome one_level = run("calibrate noise campaign.yaml -o n.yaml");
  EXPECT_EQ(one_level.exit_code, 2);
  EXPECT_NE(one_level.err.find("record at several integration times or distances"), std::string::npos) << one_level.err;
  EXPECT_FALSE(fs::exists(folder.path() / "n.yaml"));
}

}  // namespace
}  // namespace tofgraph::tests
