// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/response_calibration.hpp"

#include "io/calibration.hpp"

namespace tofgraph::io {

ResponseCalibration read_response_calibration(const std::filesystem::path& path, const std::string& camera) {
  CalibrationReader file(path, "response", camera);
  ResponseCalibration result;
  result.contrast = file.need("contrast", "", 1, "{value: 0.47, sd: 0.001}").value[0];
  if (!(result.contrast > 0 && result.contrast <= 1))
    file.error("contrast", "'contrast' must be above 0 and at most 1", "example: contrast: {value: 0.47}");
  if (file.has("gain")) {
    result.gain = file.need("gain", "counts m^2/s", 1, "{value: 7.0e6 counts m^2/s}").value[0];
    if (!(result.gain > 0)) file.error("gain", "'gain' must be positive", "example: gain: {value: 7.0e6 counts m^2/s}");
  }
  // Informative values, not used here.
  if (file.has("dark")) file.need("dark", "counts", 1, "{value: 2 counts}");
  if (file.has("dark_rate")) file.need("dark_rate", "counts/s", 1, "{value: 100 counts/s}");
  const std::pair<const char*, const char*> columns[] = {
      {"contrast_interval", ""}, {"gain_interval", "counts m^2/s"}, {"held_out", ""},       {"held_out_gain", ""},
      {"integration_time", "s"}, {"amplitude", "counts"},           {"intensity", "counts"}};
  for (const auto& [key, unit] : columns) {
    if (file.has(key)) file.column(key, unit, 0, "{value: [1]}");
  }
  file.finish();
  return result;
}

}  // namespace tofgraph::io
