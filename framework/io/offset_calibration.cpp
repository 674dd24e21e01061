// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/offset_calibration.hpp"

#include "config/quantity.hpp"
#include "io/unknown.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tofgraph/physics/to_integer.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace tofgraph::io {
namespace {

constexpr double frequency_tolerance = 1e-3;  ///< relative: a slightly detuned camera has the same offsets

void check_frequency(CalibrationReader& file, double calibrated, const tofgraph_camera& camera) {
  if (std::abs(calibrated / camera.modulation_frequency - 1) <= frequency_tolerance) return;
  file.error(
      "modulation_frequency",
      fmt::format("the calibration is for {}, the camera '{}' works at {}", config::format_quantity(calibrated, "Hz"),
                  camera.name, config::format_quantity(camera.modulation_frequency, "Hz")),
      "offsets change with the frequency: calibrate at the one that is used");
}

void check_samples(CalibrationReader& file, const OffsetCalibration& calibration) {
  if (!(calibration.gain > 0))
    return file.error("gain", "'gain' must be positive", "example: gain: {value: 7.0e6 counts m^2/s}");
  for (std::size_t target = 0; target < calibration.targets.size(); ++target) {
    if (std::ranges::find(calibration.samples, target, &physics::OffsetSample::target) == calibration.samples.end())
      return file.error("target",
                        fmt::format("no sample is of the target '{}' of the settings", calibration.targets[target]),
                        "leave it out of settings: {targets: [..]}");
  }
  for (const physics::OffsetSample& s : calibration.samples) {
    if (s.target >= calibration.targets.size())
      return file.error("target", "'target' counts the targets of 'settings' from 0: there is no such target",
                        "example: settings: {targets: [white, black]}, values: {target: {value: [0, 0, 1, 1]}}");
    if (!(s.distance > 0 && s.depth > 0 && s.integration_time > 0) || s.reflectivity <= 0)
      return file.error("distance", "distances, depths, times and reflectivities must be positive", "");
  }
}

/// Optional columns: known for all samples or for none.
Calibrated optional_column(CalibrationReader& file, const std::string& key, std::size_t count) {
  if (file.has(key)) return file.column(key, "", count, "{value: [0.85, 0.84]}");
  return {std::vector<double>(count, std::numeric_limits<double>::quiet_NaN()), {}};
}

/// Skips informative values.
void skip_report_values(CalibrationReader& file) {
  for (const char* key : {"amplitude", "measured_mean", "measured_sd", "modelled_mean", "modelled_sd",
                          "remodelled_mean", "remodelled_sd", "offset_mean", "offset_sd", "final_mean", "final_sd",
                          "rmse", "uncorrected", "held_out_distance", "held_out_target", "held_out_integration_time"}) {
    if (file.has(key)) file.column(key, std::string_view(key) == "amplitude" ? "counts" : "m", 0, "{value: [1 mm]}");
  }
}

}  // namespace

double response_of(const std::array<double, 2>& falloff, const float* ray) {
  const double z = ray[2], q = (double{ray[0]} * ray[0] + double{ray[1]} * ray[1]) / (z * z);
  return std::exp(falloff[0] * q + falloff[1] * q * q);
}

OffsetCalibration read_offset_calibration(const std::filesystem::path& path, const tofgraph_camera& camera) {
  CalibrationReader file(path, "offset", camera.name);
  OffsetCalibration result{.camera = camera.name, .serial = file.serial()};
  const std::string variant = file.setting("variant", "geometric");
  if (variant != "geometric" && variant != "printed")
    file.error("", fmt::format("'variant' of the settings is '{}', expected geometric or printed", variant), "");
  result.variant = variant == "printed" ? OffsetVariant::printed : OffsetVariant::geometric;
  result.targets = file.setting_words("targets", "[white, black]");
  result.modulation_frequency = file.need("modulation_frequency", "Hz", 1, "{value: 20 MHz}").value[0];
  result.gain = file.need("gain", "counts m^2/s", 1, "{value: 7.0e6 counts m^2/s}").value[0];
  std::ranges::copy(file.need("falloff", "", 2, "{value: [-2.1, 0.3]}").value, result.falloff.begin());
  const Calibrated target = file.column("target", "", 0, "{value: [0, 0, 1, 1]}");
  const std::size_t count = target.value.size();
  const Calibrated distance = file.column("distance", "m", count, "{unit: mm, value: [500, 1000]}");
  const Calibrated depth = file.column("depth", "m", count, "{unit: mm, value: [507.66, 998.02], sd: [0.1, 0.1]}");
  const Calibrated time = file.column("integration_time", "s", count, "{unit: ms, value: [0.5, 2]}");
  const Calibrated reflectivity = optional_column(file, "reflectivity", count);
  skip_report_values(file);
  if (result.modulation_frequency > 0) check_frequency(file, result.modulation_frequency, camera);
  const bool whole = count > 0 && distance.value.size() == count && depth.value.size() == count &&
                     time.value.size() == count && reflectivity.value.size() == count;
  for (std::size_t i = 0; whole && i < count; ++i)
    result.samples.push_back({physics::to_integer(target.value[i], std::size_t{0}), distance.value[i], depth.value[i],
                              time.value[i], reflectivity.value[i]});
  check_samples(file, result);
  result.depth_sd = depth.sd;
  file.finish();
  return result;
}

void write_offset_calibration(const OffsetCalibration& c, CalibrationWriter& writer) {
  std::vector<std::string> words;
  for (const std::string& label : c.targets) words.push_back(config::yaml_word(label));
  writer.setting("variant", c.variant == OffsetVariant::printed ? "printed" : "geometric");
  writer.setting("targets", fmt::format("[{}]", fmt::join(words, ", ")));
  writer.number("modulation_frequency", c.modulation_frequency, unknown, "MHz", 1e6);
  writer.number("gain", c.gain, unknown, "counts m^2/s", 1);
  writer.column("falloff", {{c.falloff[0], c.falloff[1]}, {}}, "", 1);
  Calibrated target, distance, depth, time, reflectivity;
  for (const physics::OffsetSample& s : c.samples) {
    target.value.push_back(static_cast<double>(s.target));
    distance.value.push_back(s.distance);
    depth.value.push_back(s.depth);
    time.value.push_back(s.integration_time);
    reflectivity.value.push_back(s.reflectivity);
  }
  depth.sd = c.depth_sd;
  writer.column("target", target, "", 1);
  writer.column("distance", distance, "mm", 1e-3);
  writer.column("integration_time", time, "ms", 1e-3);
  writer.column("depth", depth, "mm", 1e-3);
  if (std::ranges::all_of(reflectivity.value, [](double r) { return std::isfinite(r); }))
    writer.column("reflectivity", reflectivity, "", 1);
}

}  // namespace tofgraph::io
