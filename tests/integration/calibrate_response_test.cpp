// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The calibration response, compared with random taps of a camera whose contrast and gain differ from its profile.
#include <hdf5.h>

#include "calibration/calibrate.hpp"
#include "io/calibration.hpp"
#include "tests/program.hpp"
#include "tests/unit/raw_capture.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

namespace tofgraph::tests {
namespace {

constexpr std::size_t side = 24, pixels = side * side, frames = 4;
constexpr double reflectivity = 0.6, range = 7.4948114;  // m at 20 MHz

struct Truth {
  double contrast = 0.47, gain = 6.3e6, dark = 35, dark_rate = 9000;  ///< -, counts m^2/s, counts, counts/s
  double profile_contrast = 0.5;
  double gradient = 0.04;                     ///< gradient of the contrast, from the left to the right
  std::string extra = ", reflectivity: 0.6";  ///< per condition
  bool images_alone = false;                  ///< captures of amplitude and intensity instead of taps
};

class Response : public testing::Test {
 protected:
  static double contrast_of(const Truth& t, std::size_t pixel) {
    return t.contrast * (1 + t.gradient * (static_cast<double>(pixel % side) / (side - 1) - 0.5));
  }
  static bool is_dead(std::size_t pixel) { return pixel % 67 == 5; }

  /// Path from both lamps via the board to the pixel, m: lens 12.8 mm before the sensor, pixels of 330 um.
  static double whole_path(double distance, std::size_t pixel) {
    constexpr double focal = 12.8e-3, pitch = 330e-6;
    const double x = (static_cast<double>(pixel % side) - 11.5) * pitch,
                 y = (static_cast<double>(pixel / side) - 11.5) * pitch, k = (distance - focal) / focal;
    const double inside = std::hypot(x, y, focal);
    return (std::hypot(k * x + 0.05, k * y, distance) + std::hypot(k * x - 0.05, k * y, distance)) / 2 +
           (k + 1) * inside;
  }

  std::uint16_t tap(double level) {
    std::normal_distribution<double> noise(0, std::sqrt(9 + 0.012 * level));
    return static_cast<std::uint16_t>(std::clamp(std::lround(level + noise(random_)), 0L, 30000L));
  }

  void record(const Truth& truth, const std::string& name, double distance, double time) {
    std::vector<std::uint16_t> taps;
    for (std::size_t f = 0; f < frames; ++f) {
      for (std::size_t k = 0; k < 4; ++k) {
        for (const double half : {0.5, -0.5}) {
          for (std::size_t i = 0; i < pixels; ++i) {
            const double path = whole_path(distance, i), a = truth.gain * reflectivity * time / (path * path);
            const double phase =
                2 * std::numbers::pi * path / 2 / range + static_cast<double>(k) * std::numbers::pi / 2;
            const double mean = truth.dark + truth.dark_rate * time + a / (2 * contrast_of(truth, i));
            taps.push_back(is_dead(i) ? std::uint16_t{0} : tap(mean + half * a * std::cos(phase)));
          }
        }
      }
    }
    RawCapture capture(folder.path() / (name + ".h5"));
    capture.head(side, side, 1, "tofgraph-capture", "tiny");
    if (truth.images_alone)
      write_images(capture, taps);
    else
      capture.dataset("taps", {frames, 4, 2, side, side}, taps, {1, 4, 2, side, side});
    capture.metadata(frames, time);
  }

  /// Amplitude and mean of the taps of each frame.
  static void write_images(RawCapture& capture, const std::vector<std::uint16_t>& taps) {
    std::vector<float> amplitude, intensity;
    for (std::size_t i = 0; i < frames * pixels; ++i) {
      std::array<double, 4> c{};
      double sum = 0;
      for (std::size_t plane = 0; plane < 8; ++plane) {
        const double value = taps[(i / pixels * 8 + plane) * pixels + i % pixels];
        c[plane / 2] += plane % 2 == 0 ? value : -value;
        sum += value;
      }
      amplitude.push_back(static_cast<float>(std::hypot(c[3] - c[1], c[0] - c[2]) / 2));
      intensity.push_back(static_cast<float>(sum / 8));
    }
    capture.dataset("amplitude", {frames, side, side}, amplitude, {1, side, side});
    capture.dataset("intensity", {frames, side, side}, intensity, {1, side, side});
  }

  void campaign(const Truth& truth, const std::vector<double>& distances = {0.8, 1.2, 1.6, 2.0, 2.5},
                const std::vector<double>& times = {1e-3, 2e-3}) {
    write_text(folder.path() / "camera.yaml",
               fmt::format("profile: 1\nname: tiny\nwidth: 24\nheight: 24\npixel_pitch: 330 um\nfocal_length: 12.8 mm\n"
                           "principal_point: [11.5, 11.5]\nmodulation_frequency: 20 MHz\nsources:\n"
                           "  - {{name: left, position: [-50 mm, 0 mm, 0 mm], amplitude: 1}}\n"
                           "  - {{name: right, position: [50 mm, 0 mm, 0 mm], amplitude: 1}}\n"
                           "gain: 7.0e6 counts m^2/s\ncontrast: {}\nfull_well: 30000 counts\n",
                           truth.profile_contrast));
    std::string text = "campaign: 1\ncamera: camera.yaml\nconditions:\n";
    for (const double distance : distances) {
      for (const double time : times) {
        const std::string name = fmt::format("c{:.0f}-{:.0f}", 1e3 * distance, 1e3 * time);
        record(truth, name, distance, time);
        text +=
            fmt::format("  - {{id: {0}, capture: {0}.h5, board: {{distance: {1} m}}, integration_time: {2} ms{3}}}\n",
                        name, distance, 1e3 * time, truth.extra);
      }
    }
    write_text(folder.path() / "campaign.yaml", text);
  }

  calibration::Result calibrate(bool force = false) const {
    return calibration::calibrate(
        calibration::kind_of("response"),
        {.campaign = folder.path() / "campaign.yaml", .output = folder.path() / "r.yaml", .force = force});
  }

  std::mt19937_64 random_{11};
  TemporaryFolder folder;
};

TEST_F(Response, ContrastGainAndDarkLevelAreRight) {
  const Truth truth;
  campaign(truth);
  const calibration::Result result = calibrate();
  write_text(folder.path() / "r.yaml", result.file);
  io::CalibrationReader file(folder.path() / "r.yaml", "response", "tiny");
  const io::Calibrated contrast = file.need("contrast", "", 1, ""), dark = file.need("dark", "counts", 1, "");
  EXPECT_NEAR(contrast.value[0], truth.contrast, 0.002 * truth.contrast);
  EXPECT_NEAR(contrast.value[0], truth.contrast, 5 * contrast.sd[0]) << "the stated uncertainty";
  const std::vector<double> interval = file.column("contrast_interval", "", 2, "").value;
  EXPECT_LT(interval[0], contrast.value[0]);
  EXPECT_GT(interval[1], contrast.value[0]);
  EXPECT_LT(interval[1] - interval[0], 0.02 * truth.contrast);
  EXPECT_NEAR(dark.value[0], truth.dark, 2);
  EXPECT_NE(result.summary.find("gain 6.3"), std::string::npos) << result.summary;
  EXPECT_NE(result.summary.find("the profile says 0.5"), std::string::npos) << result.summary;
  // Each pixel's contrast is within its stated standard deviation; dead pixels are unknown.
  double squares = 0, count = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const double c = result.maps[0].values[i], sd = result.maps[1].values[i];
    if (is_dead(i)) {
      EXPECT_TRUE(std::isnan(c)) << i;
      continue;
    }
    squares += std::pow((c - contrast_of(truth, i)) / sd, 2);
    count += 1;
    EXPECT_NEAR(result.maps[4].values[i], truth.gain, 0.01 * truth.gain) << i;
  }
  EXPECT_NEAR(std::sqrt(squares / count), 1.1, 0.3) << "Student's of seven degrees of freedom scatters a little more";
}

TEST_F(Response, AmplitudeAndIntensityWithoutDistancesAreEnough) {
  const Truth truth{.images_alone = true};
  campaign(truth);
  const calibration::Result result = calibrate();
  write_text(folder.path() / "r.yaml", result.file);
  io::CalibrationReader file(folder.path() / "r.yaml", "response", "tiny");
  EXPECT_NEAR(file.need("contrast", "", 1, "").value[0], truth.contrast, 0.002 * truth.contrast);
  EXPECT_NEAR(file.need("dark", "counts", 1, "").value[0], truth.dark, 2);
  for (const double amplitude : file.column("amplitude", "counts", 10, "").value) EXPECT_GT(amplitude, 100);
}

TEST_F(Response, TheProfilesOwnContrastIsNotWrittenAgain) {
  campaign({.contrast = 0.5, .gain = 7e6, .dark = 0, .dark_rate = 0, .gradient = 0});
  try {
    calibrate();
    ADD_FAILURE() << "the profile predicts as well";
  } catch (const std::runtime_error& refused) {
    EXPECT_NE(std::string(refused.what()).find("% of the light"), std::string::npos) << refused.what();
  }
  EXPECT_NO_THROW(calibrate(true)) << "with force it is the user's decision";
}

TEST_F(Response, WhatIsNotThereIsSaid) {
  campaign({.extra = ""});
  const calibration::Result without = calibrate();
  EXPECT_NE(
      fmt::format("{}", fmt::join(without.notes, "\n")).find("no condition shows a board of a stated reflectivity"),
      std::string::npos);
  campaign({.extra = ", ambient: lamp"});
  EXPECT_THROW(calibrate(), config::ConfigurationError);
}

}  // namespace
}  // namespace tofgraph::tests
