// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Common part of the tests of model_correction: frames of the plain camera, decoded independently, and its
/// effects as a model file.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tofgraph/channels.hpp>
#include <tofgraph/harness.hpp>

#include <fmt/format.h>

#include "tests/hidden_effects/plain_camera.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

namespace tofgraph::hidden {

using Floats = std::vector<float>;

/// Decoded images: m, counts.
struct Decoded {
  Floats distance, amplitude;
};

/// Prints the remaining error if TOFGRAPH_SHOW_LEFT is set, beyond the check that it is small enough.
inline void show(const char* what, double distance, double effect, double left) {
  if (std::getenv("TOFGRAPH_SHOW_LEFT") == nullptr) return;
  fmt::print("{:24} {:4.1f} m: effect {:9.3f} mm, left {:8.4f} mm\n", what, distance, effect * 1e3, left * 1e3);
}

inline Decoded decoded(const PhasorImage& light) {
  Decoded result;
  for (const std::complex<double>& p : light) {
    const double phase = std::arg(p);
    result.distance.push_back(
        static_cast<float>(Camera().metres_per_radian() * (phase < 0 ? phase + 2 * M_PI : phase)));
    result.amplitude.push_back(static_cast<float>(std::abs(p)));
  }
  return result;
}

/// Spreads a fraction of the light: partly as a Gaussian, partly uniformly; dark outside the image.
inline PhasorImage scattered(const PhasorImage& light, double fraction, double width, double uniform) {
  const int size = Camera().width;
  std::vector<double> weight(static_cast<std::size_t>(2 * size));
  double sum = 0;
  for (int d = -6 * size; d <= 6 * size; ++d) sum += std::exp(-d * d / (2 * width * width));
  for (int d = 0; d < 2 * size; ++d) weight[static_cast<std::size_t>(d)] = std::exp(-d * d / (2 * width * width)) / sum;
  const auto at = [size](int row, int column) { return static_cast<std::size_t>(row * size + column); };
  PhasorImage across(light.size()), both(light.size());
  std::complex<double> mean;
  for (int row = 0; row < size; ++row)
    for (int column = 0; column < size; ++column) {
      mean += light[at(row, column)] / static_cast<double>(light.size());
      for (int other = 0; other < size; ++other)
        across[at(row, column)] += weight[static_cast<std::size_t>(std::abs(other - column))] * light[at(row, other)];
    }
  for (int row = 0; row < size; ++row)
    for (int column = 0; column < size; ++column)
      for (int other = 0; other < size; ++other)
        both[at(row, column)] += weight[static_cast<std::size_t>(std::abs(other - row))] * across[at(other, column)];
  for (std::size_t i = 0; i < light.size(); ++i)
    both[i] = light[i] + fraction * ((1 - uniform) * both[i] + uniform * mean);
  return both;
}

/// Standard deviation of a distance: that of a sample is from two taps with mean amplitude / (2 contrast).
inline float noise_of(const Camera& camera, double amplitude) {
  const double tap = camera.read_noise * camera.read_noise + camera.shot_noise * amplitude / (2 * camera.contrast);
  return static_cast<float>(camera.metres_per_radian() * std::sqrt(2 * tap) / (std::sqrt(2.0) * amplitude));
}

/// Independent phase and amplitude of the four samples. @param taps their means @param random null: no noise
inline Decoded photograph(const Physics& physics, const Taps& taps, std::mt19937_64* random = nullptr) {
  Readout readout(physics, random != nullptr ? NoiseKind::gaussian : NoiseKind::none);
  std::mt19937_64 unused;
  std::mt19937_64& noise = random != nullptr ? *random : unused;
  Decoded result;
  for (std::size_t i = 0; i < physics.camera.pixels(); ++i) {
    std::array<double, 4> c{};
    for (std::size_t k = 0; k < 4; ++k) c[k] = readout(taps.a[k][i], noise) - readout(taps.b[k][i], noise);
    const double phase = std::atan2(c[3] - c[1], c[0] - c[2]);
    const double turned = phase < 0 ? phase + 2 * M_PI : phase;
    result.distance.push_back(static_cast<float>(physics.camera.metres_per_radian() * turned));
    result.amplitude.push_back(static_cast<float>(std::hypot(c[3] - c[1], c[0] - c[2]) / 2));
  }
  return result;
}

/// Noise-free version.
inline Decoded photograph(const Physics& physics, const View& view) {
  return photograph(physics, expected_taps(physics, view));
}

/// Writes an image in NumPy's format.
inline std::string write_npy(const std::filesystem::path& file, const Image& image, const Camera& camera) {
  std::string header =
      fmt::format("{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, {}), }}", camera.height, camera.width);
  header.resize((header.size() + 10) / 64 * 64 + 64 - 10 - 1, ' ');
  header += '\n';
  std::ofstream out(file, std::ios::binary);
  out << "\x93NUMPY\x01" << '\0' << static_cast<char>(header.size() & 255) << static_cast<char>(header.size() >> 8)
      << header;
  out.write(reinterpret_cast<const char*>(image.data()), static_cast<std::streamsize>(image.size() * sizeof(double)));
  return file.string();
}

class ModelCorrection : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / fmt::format("model_correction_{}", getpid());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// The plain camera's effects as a model file.
  std::string model_of(const Physics& physics) const {
    std::string text = "model: 1\ncamera: camcube2\neffects:\n";
    for (const Effect& kind : catalogue()) {
      if (!physics.effects.has(kind.name)) continue;
      text += "  - {effect: " + kind.name;
      for (const Parameter& parameter : kind.parameters) {
        double value = physics.effects.value(kind.name, parameter.name);
        if (std::isinf(value)) continue;
        if (parameter.unit == "rad") value = std::remainder(value, 2 * M_PI);
        text += fmt::format(", {}: {} {}", parameter.name, value, parameter.unit);
      }
      if (kind.name == "fixed_pattern")
        text += fmt::format(", map: {}, slope_map: {}", npy("map", physics.maps.fixed_pattern),
                            npy("slope", physics.maps.fixed_pattern_slope));
      if (kind.name == "pixel_response") text += fmt::format(", map: {}", npy("response", physics.maps.response));
      text += "}\n";
    }
    const std::filesystem::path file = folder_ / "model.yaml";
    std::ofstream(file) << text;
    return file.string();
  }
  std::string npy(const std::string& name, const Image& image) const {
    return write_npy(folder_ / (name + ".npy"), image, Camera());
  }

  std::filesystem::path folder_;
};

/// Output of the stage for a frame of the plain camera.
inline Floats corrected(Harness& stage, const Decoded& seen, const View& view) {
  stage.put<float>("distance", {204, 204}, seen.distance);
  stage.put<float>("amplitude", {204, 204}, seen.amplitude);
  stage.metadata().integration_time = view.integration_time;
  stage.metadata().modulation_frequency = 20e6;
  stage.metadata().time_since_power_on = view.time_since_power_on;
  stage.run();
  return stage.get<float>("distance");
}

inline constexpr double range = speed_of_light / (2 * 20e6);  // m

/// Mean difference over the pixels without these flags.
inline double mean_difference(const Floats& a, const Floats& b, const std::vector<std::uint16_t>& flags) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (flags[i] != 0) continue;
    sum += std::abs(std::remainder(static_cast<double>(a[i]) - static_cast<double>(b[i]), range));
    count += 1;
  }
  EXPECT_GE(count, 0.8 * static_cast<double>(a.size())) << "too many are flagged";
  return sum / count;
}

/// Maps with pixel, row and column structure.
inline PixelMaps maps() {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  PixelMaps all;
  const Camera camera;
  std::vector<double> columns(204);
  for (double& value : columns) value = normal(random);
  for (std::size_t i = 0; i < camera.pixels(); ++i) {
    all.fixed_pattern.push_back(5e-3 * (normal(random) + columns[i % 204]));
    all.fixed_pattern_slope.push_back(1e-3 * normal(random));
    all.response.push_back(0.02 * normal(random));
  }
  return all;
}

/// Typical laboratory boards at several integration times.
inline std::vector<View> boards() {
  std::vector<View> views;
  const double distances[] = {0.6, 1.3, 2.2, 3.7, 5.1, 6.6};
  for (std::size_t i = 0; i < std::size(distances); ++i) {
    View view;
    view.distance = distances[i];
    view.reflectivity = i % 2 == 0 ? 0.85 : 0.3;
    view.integration_time = i < 3 ? 1e-3 : 5e-3;
    view.time_since_power_on = 400.0 + 700.0 * static_cast<double>(i);
    view.tilt_x = 0.1;
    views.push_back(view);
  }
  return views;
}

/// Depth of a pixel's point by bisection, with the rays and sources of the corrected camera; the equation is that of
/// the mean path.
inline double depth_of(const tofgraph_camera& camera, std::size_t i, double distance) {
  const double x = camera.rays[3 * i], y = camera.rays[3 * i + 1], z = camera.rays[3 * i + 2];
  const double f = camera.focal_length, sensor = f / z;
  const auto measured = [&](double path) {
    double sum = 0;
    for (const tofgraph_light& light : lights_of(camera))
      sum += std::hypot(x * path - light.position[0], y * path - light.position[1], f + z * path - light.position[2]);
    return (sum / static_cast<double>(camera.light_count) + path + sensor) / 2;
  };
  double low = 0, high = 20;
  for (int step = 0; step < 60; ++step) {
    const double middle = (low + high) / 2;
    (measured(middle) < distance ? low : high) = middle;
  }
  return f + z * low;
}

/// Distance from the lens to a tilted board along a pixel's ray, m.
inline double return_path(std::size_t i, const View& view) {
  const Camera camera;
  const double x = (static_cast<double>(i % 204) - camera.center_x) * camera.pitch / camera.focal_length;
  const double y = (static_cast<double>(i / 204) - camera.center_y) * camera.pitch / camera.focal_length;
  // Points P with n (P - (0, 0, distance)) = 0, n = R_x(tilt_x) e_z; P = (0, 0, f) + t (x, y, 1).
  const double ny = -std::sin(view.tilt_x), nz = std::cos(view.tilt_x);
  const double t = nz * (view.distance - camera.focal_length) / (ny * y + nz);
  return t * std::hypot(x, y, 1);
}

/// Mean and variance of each pixel.
class Statistics {
 public:
  void add(const Floats& image) {
    sum_.resize(image.size());
    square_.resize(image.size());
    for (std::size_t i = 0; i < image.size(); ++i) {
      sum_[i] += image[i];
      square_[i] += static_cast<double>(image[i]) * image[i];
    }
    count_ += 1;
  }
  /// Square root of the pixels' mean variance.
  double sd() const {
    double variance = 0;
    for (std::size_t i = 0; i < sum_.size(); ++i) variance += (square_[i] - sum_[i] * sum_[i] / count_) / (count_ - 1);
    return std::sqrt(variance / static_cast<double>(sum_.size()));
  }

 private:
  Image sum_, square_;
  double count_ = 0;
};

/// Effects of the camera that act on single pixels. Geometry is passed on as a camera, see below.
inline const char* const single[] = {
    "wiggling",       "even_harmonic",           "phase_step_error", "phase_gain",       "tap_mismatch",
    "amplitude_walk", "integration_time_offset", "crosstalk",        "zero_offset",      "static_reflection",
    "warm_up",        "fixed_pattern",           "pixel_response",   "adc_nonlinearity", "source_amplitude",
    "source_phase",   "modulation_frequency",    "beam_profile",     "vignetting"};

}  // namespace tofgraph::hidden
