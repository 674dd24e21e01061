// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Recordings of rooms made of planes, by a camera that is independent of the project's simulator:
/// rays from OpenCV's undistortPoints, intersections and noise in closed form. Each recording may have one
/// error.
#pragma once

#include <tofgraph/array.hpp>

#include <opencv2/calib3d.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "io/captures/capture.hpp"

namespace tofgraph::tests {

/// Lens and image size of a camera.
struct InspectedCamera {
  std::uint32_t width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< px
  std::array<double, 5> k = {};           ///< k1 k2 p1 p2 k3
  double pitch = 45e-6, frequency = 60e6;
  double gain = 0;  ///< counts m^2/s; 0: not stated

  std::string profile(const std::array<double, 5>& distortion) const {
    std::string list;
    for (const double value : distortion) list += (list.empty() ? "" : ", ") + std::to_string(value);
    return "profile: 1\nname: inspected\nwidth: " + std::to_string(width) + "\nheight: " + std::to_string(height) +
           "\npixel_pitch: [" + std::to_string(pitch * 1e6) + " um, " + std::to_string(pitch * 1e6 * fx / fy) +
           " um]\nfocal_length: " + std::to_string(pitch * fx * 1e3) + " mm\nprincipal_point: [" + std::to_string(cx) +
           ", " + std::to_string(cy) + "]\ndistortion: [" + list +
           "]\nmodulation_frequency: " + std::to_string(frequency * 1e-6) +
           " MHz\nsources: [{position: [0 mm, 0 mm, 0 mm]}]\n" +
           (gain > 0 ? "gain: " + std::to_string(gain) + " counts m^2/s\n" : "");
  }
};

/// A plane normal . p = offset, p in the optical frame; if half is positive, only within that distance of `middle`.
struct InspectedPlane {
  std::array<double, 3> normal;
  double offset;
  std::array<double, 3> middle = {};
  double half = 0;  ///< m
};
using InspectedScene = std::vector<InspectedPlane>;

enum class Mistake {
  none,
  range_for_depth,
  millimetres,
  k1_missing,
  k1_sign,
  mirrored,
  turned,
  swapped_phases,
  reversed_phases
};

/// Writes recordings.
class InspectedRecording {
 public:
  InspectedRecording(InspectedCamera camera, InspectedScene scene, double noise, unsigned seed)
      : camera_(std::move(camera)), scene_(std::move(scene)), noise_(noise), random_(seed) {
    make_ranges();
  }

  /// @param channel depth or range; `phases` for Mistake::swapped_phases and reversed_phases, which swap the images of
  /// 90 and 180, and of 90 and 270 degrees
  void write(const std::filesystem::path& file, Mistake mistake, std::string channel = "depth") {
    std::array<double, 5> stated = camera_.k;
    if (mistake == Mistake::k1_missing) stated = {};
    if (mistake == Mistake::k1_sign) stated[0] = -stated[0];
    if (mistake == Mistake::swapped_phases || mistake == Mistake::reversed_phases) channel = "phases";
    io::CaptureHeader header;
    header.camera = "inspected";
    header.width = camera_.width;
    header.height = camera_.height;
    header.profile = camera_.profile(stated);
    const bool raw = channel == "phases";
    std::vector<io::CaptureChannel> channels(1);
    channels[0] = {channel, TOFGRAPH_TYPE_F32, {camera_.height, camera_.width}, raw ? "counts" : "m", "", "", ""};
    if (raw)
      channels[0].extent.insert(channels[0].extent.begin(), 4);
    else
      channels.push_back({"amplitude", TOFGRAPH_TYPE_F32, {camera_.height, camera_.width}, "counts", "", "", ""});
    io::CaptureWriter writer(file, header, channels);
    for (std::size_t frame = 0; frame < 16; ++frame) {
      std::vector<float> values, amplitude;
      make_frame(mistake, channel, values, amplitude);
      for (std::size_t i = 0; i < amplitude.size() && change; ++i) change(i, frame, values[i], amplitude[i]);
      if (turned_amplitude) std::reverse(amplitude.begin(), amplitude.end());
      std::vector<tofgraph_view> views = {view(channels[0], values.data())};
      if (!raw) views.push_back(view(channels[1], amplitude.data()));
      tofgraph_metadata metadata{};
      metadata.size = sizeof metadata;
      metadata.device_number = frame;
      metadata.timestamp_ns = 1'000'000'000 + static_cast<std::int64_t>(frame) * 50'000'000;
      metadata.integration_time = 1e-3;
      metadata.modulation_frequency = camera_.frequency;
      metadata.temperature = metadata.time_since_power_on = std::nan("");
      writer.append(metadata, views);
    }
    writer.finish();
  }

  /// Rotates the amplitude image by 180 deg relative to the lengths.
  bool turned_amplitude = false;
  bool patches = true;  ///< areas of different reflectivity
  double falloff = 0;   ///< the lamp's intensity is cos^falloff of the angle from the axis
  /// Perturbation of depth and amplitude of each pixel: (pixel, frame, length, amplitude).
  std::function<void(std::size_t, std::size_t, float&, float&)> change;

  /// Depths in m and amplitudes in counts of a frame.
  std::pair<std::vector<float>, std::vector<float>> images() {
    std::pair<std::vector<float>, std::vector<float>> both;
    make_frame(Mistake::none, "depth", both.first, both.second);
    return both;
  }

  /// Bytes of an .npy file with the depths of a frame in millimetres, uint16 row by row.
  std::string npy() {
    std::vector<float> values, amplitude;
    make_frame(Mistake::none, "depth", values, amplitude);
    std::string header = "{'descr': '<u2', 'fortran_order': False, 'shape': (" + std::to_string(camera_.height) + ", " +
                         std::to_string(camera_.width) + "), }";
    header.resize(117, ' ');
    std::string bytes = std::string("\x93NUMPY\x01\x00", 8) + '\x76' + '\0' + header + '\n';
    for (const float value : values) {
      const long code = std::lround(1000 * value);
      bytes += static_cast<char>(code % 256);
      bytes += static_cast<char>(code / 256);
    }
    return bytes;
  }

 private:
  static constexpr double light = 299792458.0;

  void make_ranges() {
    std::vector<cv::Point2d> pixels, points;
    for (std::uint32_t v = 0; v < camera_.height; ++v)
      for (std::uint32_t u = 0; u < camera_.width; ++u) pixels.emplace_back(u, v);
    const cv::Matx33d matrix(camera_.fx, 0, camera_.cx, 0, camera_.fy, camera_.cy, 0, 0, 1);
    const cv::Mat k(1, 5, CV_64F, camera_.k.data());
    cv::undistortPoints(pixels, points, matrix, k, cv::noArray(), cv::noArray(),
                        cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 200, 1e-12));
    for (const cv::Point2d& p : points) {
      const double norm = std::sqrt(p.x * p.x + p.y * p.y + 1);
      const std::array<double, 3> ray = {p.x / norm, p.y / norm, 1 / norm};
      double nearest = 30;
      for (const InspectedPlane& plane : scene_) {
        const double along = dot(plane.normal, ray), range = plane.offset / along;
        if (!(range > 0) || range > nearest) continue;
        bool inside = true;
        for (std::size_t i = 0; i < 3 && plane.half > 0; ++i)
          inside = inside && std::abs(range * ray[i] - plane.middle[i]) < plane.half;
        if (inside) nearest = range;
      }
      ranges_.push_back(nearest);
      cosines_.push_back(ray[2]);
    }
  }
  static double dot(const std::array<double, 3>& a, const std::array<double, 3>& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  }

  /// Amplitude 1000 at 1 m, with patches of different reflectivity; noise_ is the standard deviation of a length there.
  void make_frame(Mistake mistake, const std::string& channel, std::vector<float>& values,
                  std::vector<float>& amplitude) {
    std::normal_distribution<double> normal;
    const std::size_t w = camera_.width, h = camera_.height, n = w * h;
    const double focal = camera_.pitch * camera_.fx;
    values.resize(channel == "phases" ? 4 * n : n);
    amplitude.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      std::size_t from = i;  // pixel of the camera that is stored here
      if (mistake == Mistake::mirrored) from = i / w * w + w - 1 - i % w;
      if (mistake == Mistake::turned) from = n - 1 - i;
      const double range = ranges_[from];
      const double patch = !patches || (from % w / 23 + from / w / 19) % 2 == 0 ? 1.0 : 0.7;
      const double expected = 1000 * patch * std::pow(cosines_[from], falloff) / (range * range),
                   sigma = noise_ * std::sqrt(1000 / expected);
      amplitude[i] = static_cast<float>(expected + std::sqrt(expected) * normal(random_));
      if (channel == "phases") {
        const double half_path = range + focal / cosines_[from] / 2 + 0;  // the lamp is at the lens, to 0.01 mm
        const double psi = 4 * M_PI * camera_.frequency * half_path / light;
        const double scatter = sigma * 4 * M_PI * camera_.frequency / light * expected * std::sqrt(2.0);
        for (std::size_t k = 0; k < 4; ++k) {
          std::size_t image = k;
          if (mistake == Mistake::swapped_phases) image = k == 1 ? 2 : k == 2 ? 1 : k;
          if (mistake == Mistake::reversed_phases) image = (4 - k) % 4;
          values[image * n + i] = static_cast<float>(expected * std::cos(psi + static_cast<double>(k) * M_PI / 2) +
                                                     scatter * normal(random_));
        }
        continue;
      }
      const bool as_range = channel == "range" || mistake == Mistake::range_for_depth;
      double length = range + sigma * normal(random_);
      if (!as_range) length = length * cosines_[from] + focal;
      values[i] = static_cast<float>(mistake == Mistake::millimetres ? 1000 * length : length);
    }
  }

  static tofgraph_view view(const io::CaptureChannel& channel, float* data) {
    tofgraph_view result = empty_view();
    result.data = data;
    result.type = channel.type;
    result.rank = static_cast<std::uint32_t>(channel.extent.size());
    std::int64_t size = 4;
    for (std::size_t i = channel.extent.size(); i-- > 0;) {
      result.extent[i] = channel.extent[i];
      result.stride[i] = size;
      size *= static_cast<std::int64_t>(channel.extent[i]);
    }
    return result;
  }

  InspectedCamera camera_;
  InspectedScene scene_;
  double noise_;
  std::mt19937 random_;
  std::vector<double> ranges_, cosines_;
};

}  // namespace tofgraph::tests
