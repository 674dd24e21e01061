// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Captures of 8 x 6 px and the profile of their camera, created within a test.
#pragma once

#include <tofgraph/array.hpp>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "io/captures/capture.hpp"
#include "tests/program.hpp"

namespace tofgraph::tests {

constexpr std::size_t small_width = 8, small_height = 6, small_pixels = small_width * small_height;

inline constexpr const char* small_profile =
    "profile: 1\nname: tiny\nwidth: 8\nheight: 6\npixel_pitch: 45 um\nfocal_length: 2 mm\n"
    "principal_point: [3.5, 2.5]\nmodulation_frequency: 20 MHz\ngain: 7.0e6 counts m^2/s\ncontrast: 0.5\n"
    "read_noise: 3 counts\nshot_noise: 0.012 counts\nfull_well: 30000 counts\n"
    "sources:\n  - {position: [0 mm, 0 mm, 0 mm]}\n";

/// Frames of float32 channels of the small camera; unset values are plausible.
struct SmallCapture {
  using Image = std::vector<float>;
  std::vector<std::pair<std::string, std::vector<Image>>> channels;  ///< name, an image for each frame
  std::vector<std::vector<std::uint16_t>> flags;                     ///< for each frame; empty: none
  std::vector<std::int64_t> timestamps;                              ///< ns; default: 100 ms apart
  double frequency = 20e6, time = 1e-3;                              ///< Hz, s
  std::vector<double> times;                                         ///< s, one per frame; default: time
  std::vector<double> power_on;                                      ///< s; default: unknown
  double temperature = std::nan("");                                 ///< K

  void write(const std::filesystem::path& file) const {
    io::CaptureHeader header;
    header.camera = "tiny";
    header.width = small_width;
    header.height = small_height;
    std::vector<io::CaptureChannel> made;
    for (const auto& [name, images] : channels) made.push_back(described(name, images.at(0).size() / small_pixels));
    if (!flags.empty()) made.push_back({"flags", TOFGRAPH_TYPE_U16, {small_height, small_width}, "", "", "", ""});
    io::CaptureWriter writer(file, header, made);
    for (std::size_t frame = 0; frame < channels.at(0).second.size(); ++frame) {
      std::vector<tofgraph_view> views;
      for (std::size_t i = 0; i < channels.size(); ++i)
        views.push_back(view(made[i], const_cast<float*>(channels[i].second.at(frame).data()), 4));
      if (!flags.empty()) views.push_back(view(made.back(), const_cast<std::uint16_t*>(flags.at(frame).data()), 2));
      writer.append(metadata(frame), views);
    }
    writer.finish();
  }

 private:
  static io::CaptureChannel described(const std::string& name, std::size_t each) {
    const bool counts = name == "amplitude" || name == "phases";
    io::CaptureChannel channel{name, TOFGRAPH_TYPE_F32, {small_height, small_width}, counts ? "counts" : "m", "", "",
                               ""};
    if (name == "points") channel.extent.push_back(3);
    if (name == "phases") channel.extent.insert(channel.extent.begin(), each);
    return channel;
  }

  static tofgraph_view view(const io::CaptureChannel& channel, void* data, std::int64_t size) {
    tofgraph_view result = empty_view();
    result.data = data;
    result.type = channel.type;
    result.rank = static_cast<std::uint32_t>(channel.extent.size());
    for (std::size_t i = channel.extent.size(); i-- > 0;) {
      result.extent[i] = channel.extent[i];
      result.stride[i] = size;
      size *= static_cast<std::int64_t>(channel.extent[i]);
    }
    return result;
  }

  tofgraph_metadata metadata(std::size_t frame) const {
    tofgraph_metadata result{};
    result.size = sizeof result;
    result.device_number = frame;
    result.timestamp_ns =
        timestamps.empty() ? 1'000'000'000 + static_cast<std::int64_t>(frame) * 100'000'000 : timestamps.at(frame);
    result.integration_time = times.empty() ? time : times.at(frame);
    result.modulation_frequency = frequency;
    result.temperature = temperature;
    result.time_since_power_on = power_on.empty() ? std::nan("") : power_on.at(frame);
    return result;
  }
};

/// A plane perpendicular to the axis, as ranges from the lens, m.
inline SmallCapture::Image plane_ranges(double distance) {
  SmallCapture::Image image;
  for (std::size_t i = 0; i < small_pixels; ++i) {
    const double x = (static_cast<double>(i % small_width) - 3.5) * 0.045 / 2,
                 y = (static_cast<double>(i / small_width) - 2.5) * 0.045 / 2;
    image.push_back(static_cast<float>(distance * std::sqrt(1 + x * x + y * y)));
  }
  return image;
}

/// The four phases of a distance in every pixel, counts.
inline SmallCapture::Image four_phases(double distance, double frequency) {
  SmallCapture::Image image;
  const double phase = 4 * M_PI * frequency * distance / 299792458.0;
  for (int k = 0; k < 4; ++k)
    image.insert(image.end(), small_pixels, static_cast<float>(1000 * std::cos(phase + k * M_PI / 2)));
  return image;
}

/// A folder with the profile `camera.yaml`, in which pipelines are run.
class SmallCamera : public testing::Test {
 protected:
  SmallCamera() { write_text(folder_.path() / "camera.yaml", small_profile); }

  std::filesystem::path file(const std::string& name) const { return folder_.path() / name; }
  Outcome run(const std::string& pipeline, const std::string& options = "") const {
    return shell("\"$TOFGRAPH\" run \"" + pipeline + "\" --camera ./camera.yaml " + options, folder_.path());
  }
  static bool says(const Outcome& outcome, const std::string& words) {
    return outcome.err.find(words) != std::string::npos || outcome.out.find(words) != std::string::npos;
  }
  static std::string all(const Outcome& outcome) { return outcome.out + outcome.err; }

  TemporaryFolder folder_;
};

}  // namespace tofgraph::tests
