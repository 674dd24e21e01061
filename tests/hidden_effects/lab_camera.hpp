// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A camera with all errors at once, and the recordings that a lab makes to calibrate and evaluate it: lens,
/// unequal lamps, waveform, integration time, crosstalk, warm-up, constant, fixed pattern, noise with outliers, bad
/// pixels, and a contrast other than the profile's.
#pragma once

#include "tests/hidden_effects/defects.hpp"
#include "tests/hidden_effects/plain_camera.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::hidden {

/// Noise of the sensor: read noise (sd of a tap, counts), shot noise (variance per count, counts), share of bad pixels.
struct Sensor {
  double read_noise = 4.5, shot_noise = 0.018, bad_pixels = 0.05;
};

class LabCamera {
 public:
  /// @param side px, of the square sensor, which is 8.16 mm wide for any number @param seed of signs, phases, maps, bad
  /// pixels, light power, and all noise
  LabCamera(int side, std::uint64_t seed, NoiseKind noise, const Sensor& sensor);

  /// Writes the profile `lab.yaml` as stated in a data sheet, and folders with campaign.yaml and captures: lens, noise,
  /// response, warm, pattern, offset (for calibration), and new, cold, corner (for evaluation); new_limits.txt: the
  /// lowest possible noise of each recording of `new`.
  /// @param camera name in the campaigns @param foreign writes raw dumps (NAME.raw instead of NAME.h5) and layout.yaml,
  /// from which `tofgraph convert` makes the captures
  void record_all(const std::filesystem::path& folder, const std::string& camera, bool foreign) const;

 private:
  void write_profile(const std::filesystem::path& file) const;

  Physics physics_;
  NoiseKind noise_;
  std::vector<Defect> defects_;
  std::uint64_t seed_;
};

}  // namespace tofgraph::hidden
