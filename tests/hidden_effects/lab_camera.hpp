// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A camera with everything wrong at once, and the recordings that a lab makes to calibrate and to judge it:
/// lens, unequal lamps, waveform, integration time, crosstalk, warm-up, constant, fixed pattern, noise with outliers,
/// bad pixels, and a contrast that is not the profile's.
#pragma once

#include "tests/hidden_effects/defects.hpp"
#include "tests/hidden_effects/plain_camera.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::hidden {

class LabCamera {
 public:
  /// @param side px, of the square sensor, of 8.16 mm whatever their number @param seed draws signs, phases, maps,
  /// bad pixels, light power, and all noise
  LabCamera(int side, std::uint64_t seed, NoiseKind noise);

  /// Writes the profile `lab.yaml` as a data sheet states it, and a folder each with campaign.yaml and captures: lens,
  /// noise, response, warm, pattern, offset (what is calibrated from), and new, cold, corner (what is judged by);
  /// new_limits.txt: the least noise of each recording of `new`.
  /// @param camera as the campaigns name it @param foreign raw dumps (NAME.raw in place of NAME.h5) and layout.yaml,
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
