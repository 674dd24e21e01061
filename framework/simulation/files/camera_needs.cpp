// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/files/camera_needs.hpp"

#include "config/paths.hpp"

#include <fmt/format.h>

#include <cmath>

namespace tofgraph::simulation {

std::vector<Need> missing_for_light(const tofgraph_camera& camera) {
  std::vector<Need> missing;
  const auto need = [&](bool there, const char* key, const char* example) {
    if (!there) missing.push_back({key, example});
  };
  need(camera.focal_length > 0, "focal length in metres", "pixel_pitch: 40 um and focal_length: 12.8 mm");
  need(camera.light_count > 0, "sources", "sources: [{name: lamp, position: [0 mm, 0 mm, 0 mm]}]");
  need(camera.modulation_frequency > 0, "modulation_frequency", "modulation_frequency: 20 MHz");
  need(camera.gain > 0, "gain", "gain: 7.0e6 counts m^2/s");
  need(camera.contrast > 0, "contrast", "contrast: 0.5");
  return missing;
}

bool has_noise(const tofgraph_camera& camera) {
  return std::isfinite(camera.read_noise) && std::isfinite(camera.shot_noise);
}

std::string keys_of(const std::vector<Need>& missing) {
  std::string text;
  for (std::size_t i = 0; i < missing.size(); ++i)
    text += (i == 0 ? "" : i + 1 < missing.size() ? ", " : " and ") + missing[i].key;
  return text;
}

std::string place_of_profile(const io::Camera& camera) {
  if (camera.file.empty()) return "its profile";
  // The path of an installed profile is of no use to the reader; its name identifies it.
  const bool ours = camera.file.parent_path() == config::profile_folder();
  return ours ? fmt::format("the profile '{}'", camera.file.stem().string()) : camera.file.string();
}

std::string added_to_profile(const io::Camera& camera, const std::vector<Need>& missing) {
  std::string text = fmt::format("add to {} the values of the camera, written like", place_of_profile(camera));
  for (std::size_t i = 0; i < missing.size(); ++i) text += (i == 0 ? " " : "; ") + missing[i].example;
  return text;
}

}  // namespace tofgraph::simulation
