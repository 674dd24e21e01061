// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Cameras for tests, defined here so that no test depends on a profile.
#pragma once

#include <tofgraph/plugin.h>
#include <tofgraph/physics/lens.hpp>

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <string>
#include <vector>

namespace test {

/// A camera that owns its sources and rays.
struct Camera {
  tofgraph_camera view{};
  std::vector<tofgraph_light> lights;
  std::vector<float> rays;

  Camera(const Camera&) = delete;
  Camera(std::uint32_t width, std::uint32_t height, double focal_length, double pitch,
         std::vector<tofgraph_light> sources)
      : lights(std::move(sources)), rays(std::size_t{width} * height * 3) {
    view.size = sizeof view;
    view.light_size = sizeof(tofgraph_light);
    view.name = "test";
    view.width = width;
    view.height = height;
    view.focal_length = focal_length;
    for (int i = 0; i < 2; ++i) {
      view.pitch[i] = pitch;
      view.focal_px[i] = focal_length / pitch;
    }
    view.principal_point[0] = (width - 1) / 2.0;
    view.principal_point[1] = (height - 1) / 2.0;
    view.modulation_frequency = 20e6;
    view.frame_rate = 80;
    view.integration_time[0] = 0.5e-3;
    view.integration_time[1] = 50e-3;
    view.gain = 7e6;
    view.contrast = 0.5;
    view.read_noise = 3;
    view.shot_noise = 0.012;
    view.full_well = 30000;
    view.lights = lights.data();
    view.light_count = lights.size();
    view.profile = "";
    make_rays();
  }
  void make_rays() {
    tofgraph::physics::pixel_rays(view, rays.data());
    view.rays = rays.data();
  }
  const float* ray(std::size_t row, std::size_t column) const { return &rays[3 * (row * view.width + column)]; }
};

/// The nominal PMD CamCube 2.0.
inline Camera camcube2(std::vector<tofgraph_light> sources = {{"left", {-0.05, 0, 0}, 1}, {"right", {0.05, 0, 0}, 1}}) {
  return {204, 204, 12.8e-3, 40e-6, std::move(sources)};
}

/// Writes the camera's profile, without its NaN values, to a new file and returns its path, for stages that identify
/// cameras by profile. The files are removed when the program exits.
inline std::string profile_of(const tofgraph_camera& camera) {
  static struct Files : std::vector<std::filesystem::path> {
    ~Files() {
      std::error_code ignored;
      for (const auto& written : *this) std::filesystem::remove(written, ignored);
    }
  } files;
  const auto path =
      files.emplace_back(std::filesystem::temp_directory_path() /
                         ("tofgraph_test_" + std::to_string(getpid()) + "_" + std::to_string(files.size()) + ".yaml"));
  std::ofstream file(path);
  file << std::setprecision(17);
  const auto line = [&file](const char* key, double value, const char* unit) {
    if (!std::isnan(value)) file << key << ": " << value << " " << unit << "\n";
  };
  file << "profile: 1\nname: " << camera.name << "\nwidth: " << camera.width << "\nheight: " << camera.height << "\n";
  line("pixel_pitch", camera.pitch[0], "m");
  if (std::isnan(camera.focal_length))
    file << "focal_length: [" << camera.focal_px[0] << " px, " << camera.focal_px[1] << " px]\n";
  line("focal_length", camera.focal_length, "m");
  file << "principal_point: [" << camera.principal_point[0] << ", " << camera.principal_point[1] << "]\ndistortion: [";
  for (int i = 0; i < 5; ++i) file << camera.distortion[i] << ", ";
  for (int i = 0; i < 7; ++i) file << camera.further_distortion[i] << (i < 6 ? ", " : "]\n");
  line("skew", camera.skew, "");
  line("modulation_frequency", camera.modulation_frequency, "Hz");
  line("frame_rate", camera.frame_rate, "Hz");
  line("gain", camera.gain, "counts m^2/s");
  line("contrast", camera.contrast, "");
  line("read_noise", camera.read_noise, "counts");
  line("shot_noise", camera.shot_noise, "counts");
  line("full_well", camera.full_well, "counts");
  file << "integration_time: [" << camera.integration_time[0] << " s, " << camera.integration_time[1] << " s]\n";
  if (camera.exposure_count > 0) file << "exposures:\n";
  for (std::uint64_t i = 0; i < camera.exposure_count; ++i) {
    file << "  - {phase: " << camera.exposures[i].phase << " rad";
    if (camera.exposures[i].frequency > 0) file << ", frequency: " << camera.exposures[i].frequency << " Hz";
    file << "}\n";
  }
  file << "sources:\n";
  for (std::uint64_t i = 0; i < camera.light_count; ++i) {
    const tofgraph_light& light = camera.lights[i];
    file << "  - {name: " << light.name << ", position: [" << light.position[0] << " m, " << light.position[1] << " m, "
         << light.position[2] << " m], amplitude: " << light.amplitude << "}\n";
  }
  return path;
}

}  // namespace test
