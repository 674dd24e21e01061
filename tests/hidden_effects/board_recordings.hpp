// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Recordings of decoded frames made with the plain camera, for testing calibrations from boards.
#pragma once

#include "io/campaign.hpp"
#include "io/captures/capture.hpp"
#include "tests/hidden_effects/plain_camera.hpp"

#include <cmath>
#include <random>
#include <string>
#include <vector>

namespace tofgraph::hidden {

/// Output frame of a camera that decodes internally.
struct DecodedImages {
  std::vector<float> distance, amplitude;
};

/// Noise-free images; distances are within the unambiguous range.
inline DecodedImages decoded_images(const Physics& physics, const View& view) {
  const SensorLight light = light_on_sensor(physics, view, 0);
  DecodedImages images;
  const double scale = physics.camera.metres_per_radian(), range = 2 * M_PI * scale;
  for (const std::complex<double> phasor : light.phasor) {
    const double folded = scale * std::arg(phasor);
    images.distance.push_back(static_cast<float>(folded < 0 ? folded + range : folded));
    images.amplitude.push_back(static_cast<float>(std::abs(phasor)));
  }
  return images;
}

/// Noise of two frames: the second has that of the first with opposite sign, so that means of few frames show the error
/// of a method rather than the residual noise of few frames.
class PairedNoise {
 public:
  PairedNoise(std::uint64_t seed, double distance_sd, double amplitude_sd)
      : random_(seed), distance_(0, distance_sd), amplitude_(0, amplitude_sd) {}

  DecodedImages operator()(const DecodedImages& images) {
    if (sign_ > 0) {
      drawn_ = images;
      for (float& d : drawn_.distance) d = static_cast<float>(distance_(random_));
      for (float& a : drawn_.amplitude) a = static_cast<float>(amplitude_(random_));
    }
    DecodedImages noisy = images;
    for (std::size_t i = 0; i < noisy.distance.size(); ++i) {
      noisy.distance[i] += sign_ * drawn_.distance[i];
      noisy.amplitude[i] += sign_ * drawn_.amplitude[i];
    }
    sign_ = -sign_;
    return noisy;
  }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> distance_, amplitude_;
  DecodedImages drawn_;
  float sign_ = 1;
};

inline tofgraph_view view_of(const std::vector<float>& image, std::uint64_t rows, std::uint64_t columns) {
  tofgraph_view view{};
  view.size = sizeof view;
  view.data = const_cast<float*>(image.data());
  view.type = TOFGRAPH_TYPE_F32;
  view.rank = 2;
  view.extent[0] = rows;
  view.extent[1] = columns;
  view.stride[0] = static_cast<std::int64_t>(columns * sizeof(float));
  view.stride[1] = sizeof(float);
  return view;
}

/// Writes distance and amplitude of several frames.
inline void record(const std::filesystem::path& file, const std::vector<DecodedImages>& frames, double integration_time,
                   const std::string& serial = "") {
  const Camera camera;
  const auto rows = static_cast<std::uint64_t>(camera.height), columns = static_cast<std::uint64_t>(camera.width);
  io::CaptureHeader header;
  header.camera = "camcube2";
  header.width = static_cast<std::uint32_t>(columns);
  header.height = static_cast<std::uint32_t>(rows);
  header.serial = serial;
  io::CaptureWriter writer(
      file, header,
      {{.name = "distance", .type = TOFGRAPH_TYPE_F32, .extent = {rows, columns}, .unit = "m"},
       {.name = "amplitude", .type = TOFGRAPH_TYPE_F32, .extent = {rows, columns}, .unit = "counts"}});
  tofgraph_metadata metadata{};
  metadata.size = sizeof metadata;
  metadata.integration_time = integration_time;
  metadata.modulation_frequency = camera.modulation_frequency;
  metadata.temperature = metadata.time_since_power_on = std::numeric_limits<double>::quiet_NaN();
  for (const DecodedImages& frame : frames) {
    metadata.timestamp_ns = 1'300'000'000'000'000'000 + static_cast<std::int64_t>(writer.frames()) * 12'500'000;
    const tofgraph_view views[] = {view_of(frame.distance, rows, columns), view_of(frame.amplitude, rows, columns)};
    writer.append(metadata, views);
  }
  writer.finish();
}

}  // namespace tofgraph::hidden
