// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/intrinsics_calibration.hpp"

#include <algorithm>
#include <span>

namespace tofgraph::io {
namespace {

/// Skips an informative value: key and unit.
void skip(CalibrationReader& file) {
  constexpr std::pair<const char*, const char*> keys[] = {
      {"board_warp", "m"},         {"range_offset", "m"},        {"range_scale", ""},        {"corner_sd", "px"},
      {"variance_factor", ""},     {"reprojection", "px"},       {"held_out_views", "px"},   {"two_sets", "px"},
      {"uncertainty_range", "m"},  {"uncertainty_centre", "px"}, {"uncertainty_mean", "px"}, {"uncertainty_max", "px"},
      {"view_reprojection", "px"}, {"view_rotation", "rad"},     {"view_translation", "m"}};
  for (const auto& [key, unit] : keys)
    if (file.has(key)) file.column(key, unit, 0, "{value: [1]}");
}

}  // namespace

std::string read_intrinsics_calibration(const std::filesystem::path& path, tofgraph_camera& camera) {
  CalibrationReader file(path, "intrinsics", camera.name);
  const auto set = [&file](const char* key, const char* unit, const char* example, std::span<double> to) {
    std::ranges::copy(file.need(key, unit, to.size(), example).value, to.begin());
  };
  set("focal_length", "px", "{value: [318.2 px, 318.4 px], sd: [0.3 px, 0.3 px]}", camera.focal_px);
  set("principal_point", "px", "{value: [101.3 px, 101.7 px], sd: [0.2 px, 0.2 px]}", camera.principal_point);
  const bool fisheye = file.has("fisheye");
  camera.lens_model = fisheye ? TOFGRAPH_LENS_FISHEYE : TOFGRAPH_LENS_OPENCV;
  std::ranges::fill(camera.distortion, 0.0);
  std::ranges::fill(camera.further_distortion, 0.0);
  if (fisheye)
    set("fisheye", "", "{value: [0.02, -0.01, 0, 0], sd: [0.001, 0.002, 0.001, 0.001]}",
        std::span(camera.distortion, 4));
  else
    set("distortion", "", "{value: [-0.44, 0.22, 0, 0, 0], sd: [0.01, 0.05, 0.001, 0.001, 0]}", camera.distortion);
  camera.skew = 0;
  if (file.has("rational")) set("rational", "", "{value: [0.1, 0, 0]}", std::span(camera.further_distortion, 3));
  if (file.has("skew")) set("skew", "", "{value: 0.001}", {&camera.skew, 1});
  skip(file);
  file.finish();
  return file.serial();
}

}  // namespace tofgraph::io
