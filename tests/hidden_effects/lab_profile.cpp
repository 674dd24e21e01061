// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The camera's profile according to its data sheet: focal length, contrast and noise differ from the true values.
#include "tests/hidden_effects/lab_camera.hpp"

#include <fmt/format.h>

#include <fstream>

namespace tofgraph::hidden {

void LabCamera::write_profile(const std::filesystem::path& file) const {
  const int side = physics_.camera.width;
  std::ofstream(file) << fmt::format(
      "profile: 1\nname: lab\nwidth: {0}\nheight: {0}\npixel_pitch: {1} um\nfocal_length: 12.8 mm\n"
      "principal_point: [{2}, {2}]\nmodulation_frequency: 20 MHz\nsources:\n"
      "  - {{name: left, position: [-50 mm, 0 mm, 0 mm]}}\n  - {{name: right, position: [50 mm, 0 mm, 0 mm]}}\n"
      "integration_time: [0.5 ms, 50 ms]\ngain: 7.0e6 counts m^2/s\ncontrast: 0.5\nread_noise: 3 counts\n"
      "shot_noise: 0.012 counts\nfull_well: 30000 counts\n",
      side, 8160.0 / side, (side - 1) / 2.0);
}

}  // namespace tofgraph::hidden
