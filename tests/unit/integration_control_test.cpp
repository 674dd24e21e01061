// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Controller of the integration time with a minimal camera: amplitude and taps in closed form.
#include <gtest/gtest.h>

#include <cmath>

#include "config/diagnostics.hpp"
#include "devices/camcube/integration_control.hpp"
#include "tests/unit/capture_fixture.hpp"

namespace tofgraph::tests {
namespace {

using camcube::ControlLimits;
using camcube::IntegrationControl;

const ControlLimits usual{1000, 8000, 0.9, 30000, {0.5e-3, 50e-3}};

/// Four images of a phase of 0.7 rad, amplitude proportional to the time; a tap is amplitude (1 + cos) and clips.
std::vector<std::uint16_t> taps_of(double counts_per_second, double time, double full_well = 30000) {
  constexpr std::size_t pixels = 700;
  std::vector<std::uint16_t> taps(8 * pixels);
  for (std::size_t k = 0; k < 4; ++k) {
    const double half = 0.5 * std::cos(0.7 + static_cast<double>(k) * M_PI / 2), light = counts_per_second * time;
    const auto tap = [&](double share) { return static_cast<std::uint16_t>(std::min(light * share, full_well)); };
    for (std::size_t i = 0; i < pixels; ++i) {
      taps[2 * k * pixels + i] = tap(1 + half);
      taps[(2 * k + 1) * pixels + i] = tap(1 - half);
    }
  }
  return taps;
}

/// Final integration time, with as many frames in flight as in a camera.
double settled(double counts_per_second, double start, const ControlLimits& limits, int& changes) {
  IntegrationControl control(limits);
  std::vector<double> times(3, start);  // of the frames in flight
  changes = 0;
  for (int frame = 0; frame < 100; ++frame) {
    const double time = times[0];
    times = {times[1], times[2], times[2]};
    if (const auto next = control.next(taps_of(counts_per_second, time), time)) {
      times[2] = *next;
      ++changes;
    }
  }
  return times[0];
}

TEST(IntegrationControl, BringsTheAmplitudeIntoItsRange) {
  for (const double light : {3e4, 1e5, 1e6, 5e6}) {
    for (const double start : {0.5e-3, 2e-3, 50e-3}) {
      int changes = 0;
      const double time = settled(light, start, usual, changes), amplitude = light * time;
      EXPECT_GE(amplitude, 999) << light << " " << start;
      EXPECT_LE(amplitude, 8001) << light << " " << start;
      EXPECT_LE(changes, 6) << "and stays there";
      EXPECT_NEAR(time * 1e6, std::round(time * 1e6), 1e-6) << "whole microseconds";
    }
  }
}

TEST(IntegrationControl, StaysWithinTheTimesOfTheCamera) {
  int changes = 0;
  EXPECT_DOUBLE_EQ(settled(1e3, 1e-3, usual, changes), 50e-3);
  EXPECT_DOUBLE_EQ(settled(1e9, 1e-3, usual, changes), 0.5e-3);
}

TEST(IntegrationControl, AvoidsSaturationBeforeItSeeksAmplitude) {
  const ControlLimits greedy{20000, 60000, 0.9, 30000, {0.5e-3, 50e-3}};  // a range beyond the full well
  int changes = 0;
  const double light = 1e6, brightest = light * settled(light, 1e-3, greedy, changes) * 1.5;
  EXPECT_LT(brightest, 0.9 * 30000);
  EXPECT_GT(brightest, 0.5 * 30000);
}

TEST(IntegrationControl, LeavesFramesWithTheFormerTimeOut) {
  IntegrationControl control(usual);
  const auto asked = control.next(taps_of(1e5, 1e-3), 1e-3);  // amplitude 100: increases by a factor of 8 at most
  ASSERT_TRUE(asked);
  EXPECT_DOUBLE_EQ(*asked, 8e-3);
  EXPECT_FALSE(control.next(taps_of(1e5, 1e-3), 1e-3)) << "was under way";
  EXPECT_TRUE(control.next(taps_of(1e5, 8e-3), 8e-3)) << "800 counts are still too few";
}

TEST_F(CaptureFile, ACalibrationNarrowsTheTimes) {
  const auto file = folder.path() / "times.yaml";
  write_text(file,
             "calibration: 1\nkind: integration-time\ncamera: camcube2\ninputs: []\nsettings: {targets: [white]}\n"
             "values:\n  target: {value: [0, 0]}\n  distance: {unit: mm, value: [500, 1000]}\n"
             "  integration_time: {unit: ms, value: [1, 4]}\n  rmse: {unit: mm, value: [3, 4]}\n"
             "  shortest: {unit: ms, value: [0.8, 2]}\n  longest: {unit: ms, value: [2, 9]}\n"
             "  saturates: {unit: ms, value: [3, 12]}\n"
             "  recommended: {value: 2 ms}\n  recommended_error: {value: 5 mm}\n");
  ControlLimits limits = usual;
  EXPECT_DOUBLE_EQ(camcube::use_calibration(file.string(), "camcube2", limits), 2e-3);
  EXPECT_DOUBLE_EQ(limits.times[0], 0.8e-3);
  EXPECT_DOUBLE_EQ(limits.times[1], 9e-3);
  EXPECT_THROW(camcube::use_calibration(file.string(), "camcube3", limits), config::ConfigurationError);
}

}  // namespace
}  // namespace tofgraph::tests
