// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Keeps the amplitude of a live camera in its range, by the integration time.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::camcube {

struct ControlLimits {
  double low = 0, high = 0;          ///< counts, of the amplitude's percentile
  double percentile = 0;             ///< 0..1, of the pixels
  double full_well = 0;              ///< counts of a tap; NaN: not known
  std::array<double, 2> times = {};  ///< s, shortest and longest
};

/// Narrows the times to those that a calibration of the kind integration-time found good.
/// @returns the time that it recommends, s; NaN: none
/// @throws config::ConfigurationError
double use_calibration(const std::string& file, const std::string& camera, ControlLimits& limits);

/// Amplitude and tap are proportional to the time; one step therefore suffices where nothing is saturated.
class IntegrationControl {
 public:
  explicit IntegrationControl(const ControlLimits& limits) : limits_(limits) {}

  /// Evaluates one frame. Frames in flight at a change of the time are skipped, by their own time.
  /// @param taps 4 x (A, B) x pixels @param time of this frame, s
  /// @returns the time for the frames to come in whole microseconds; nothing: it stays
  std::optional<double> next(std::span<const std::uint16_t> taps, double time);

 private:
  void measure(std::span<const std::uint16_t> taps);

  ControlLimits limits_;
  std::optional<double> before_;  ///< s, of the frames before another time was asked for, and none since has another
  int ignored_ = 0;               ///< frames since then
  std::vector<float> amplitudes_, taps_;
};

}  // namespace tofgraph::camcube
