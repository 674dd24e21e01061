// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/noise_calibration.hpp"

#include "io/calibration.hpp"

namespace tofgraph::io {

NoiseCalibration read_noise_calibration(const std::filesystem::path& path, const std::string& camera) {
  CalibrationReader file(path, "noise", camera);
  NoiseCalibration result{.serial = file.serial()};
  result.noise.read_noise = file.need("read_noise", "counts", 1, "{value: 3 counts, sd: 0.01 counts}").value[0];
  result.noise.shot_noise = file.need("shot_noise", "counts", 1, "{value: 0.012 counts}").value[0];
  if (result.noise.read_noise < 0) file.error("read_noise", "'read_noise' must not be negative", "");
  if (result.noise.shot_noise < 0) file.error("shot_noise", "'shot_noise' must not be negative", "");
  // Informative values, not used here.
  if (file.has("converter_gain")) file.need("converter_gain", "e/counts", 1, "{value: 83 e/counts}");
  if (file.has("bad_pixels")) file.need("bad_pixels", "", 1, "{value: 3}");
  const std::pair<const char*, const char*> columns[] = {{"held_out_integration_time", ""},
                                                         {"held_out_condition", ""},
                                                         {"integration_time", "s"},
                                                         {"amplitude", "counts"},
                                                         {"sigma", "m"},
                                                         {"predicted_sigma", "m"},
                                                         {"strength", "m"}};
  for (const auto& [key, unit] : columns) {
    if (file.has(key)) file.column(key, unit, 0, "{value: [1]}");
  }
  file.finish();
  return result;
}

}  // namespace tofgraph::io
