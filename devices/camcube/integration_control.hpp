// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Control of a live camera's amplitude by its integration time.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::camcube {

struct ControlLimits {
  double low = 0, high = 0;          ///< counts, range of the amplitude's percentile
  double percentile = 0;             ///< 0..1, of the pixels
  double full_well = 0;              ///< counts of a tap; NaN: unknown
  std::array<double, 2> times = {};  ///< s, shortest and longest
};

/// Narrows the times to the range determined by a calibration of the kind integration-time.
/// @returns the recommended time, s; NaN: none
/// @throws config::ConfigurationError
double use_calibration(const std::string& file, const std::string& camera, ControlLimits& limits);

/// Integration time controller. Amplitude and taps are proportional to the time: one step suffices unless saturated.
class IntegrationControl {
 public:
  explicit IntegrationControl(const ControlLimits& limits) : limits_(limits) {}

  /// Evaluates one frame. After a change of the time, frames that still have another time are skipped.
  /// @param taps 4 x (A, B) x pixels @param time of this frame, s
  /// @returns the time of the following frames in whole microseconds; nothing: unchanged
  std::optional<double> next(std::span<const std::uint16_t> taps, double time);

 private:
  void measure(std::span<const std::uint16_t> taps);

  ControlLimits limits_;
  std::optional<double> before_;  ///< s, of the frames before a change was requested, until one has another time
  int ignored_ = 0;               ///< frames since the request
  std::vector<float> amplitudes_, taps_;
};

}  // namespace tofgraph::camcube
