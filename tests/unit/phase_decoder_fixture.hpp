// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Samples of known distances with arbitrary exposures, results of decoding them, and least squares by QR.
#pragma once

#include <tofgraph/harness.hpp>

#include <Eigen/Dense>

#include "tests/unit/cameras.hpp"

#include <cmath>
#include <random>

namespace test {

inline constexpr double c_light = 299792458.0, pi = 3.14159265358979323846, deg = pi / 180;

using Steps = std::vector<tofgraph_exposure>;

/// Three steps of 120 degrees at each frequency.
inline Steps three_at(const std::vector<double>& frequencies, int steps = 3) {
  Steps all;
  for (const double frequency : frequencies)
    for (int k = 0; k < steps; ++k) all.push_back({k * 2 * pi / steps, frequency});
  return all;
}

inline const std::vector<double> nine_images = {80e6, 16e6, 120e6};

inline double range_of(double frequency) { return c_light / (2 * frequency); }

/// Row of pixels.
struct Scene {
  std::vector<double> distances;
  double amplitude = 1000;  // counts
  double noise = 0;         // counts, sd of a sample
  unsigned seed = 1;
};

template <class T = float> std::vector<T> samples_of(const Steps& steps, const Scene& scene) {
  std::mt19937 generator(scene.seed);
  std::normal_distribution<double> normal;
  std::vector<T> samples;
  for (const auto& step : steps) {
    for (const double d : scene.distances) {
      const double c = scene.amplitude * std::cos(4 * pi * step.frequency * d / c_light + step.phase);
      samples.push_back(static_cast<T>(c + scene.noise * normal(generator)));
    }
  }
  return samples;
}

/// Number of rows of an image with this number of pixels.
inline std::size_t rows_of(std::size_t pixels) {
  std::size_t rows = 1;
  while (pixels / rows > 16000 || pixels % rows != 0) ++rows;
  return rows;
}

/// @param read_noise of a tap, counts
inline std::string profile(const Steps& steps, std::size_t pixels, double read_noise = 1) {
  static std::vector<std::unique_ptr<Camera>> cameras;
  auto& camera = *cameras.emplace_back(std::make_unique<Camera>(
      static_cast<std::uint32_t>(pixels / rows_of(pixels)), static_cast<std::uint32_t>(rows_of(pixels)), 12.8e-3, 40e-6,
      std::vector<tofgraph_light>{{"lamp", {0, 0, 0}, 1}}));
  camera.view.exposures = steps.data();
  camera.view.exposure_size = sizeof(tofgraph_exposure);
  camera.view.exposure_count = steps.size();
  camera.view.modulation_frequency = !steps.empty() && steps[0].frequency > 0 ? steps[0].frequency : 20e6;
  camera.view.read_noise = read_noise;
  camera.view.shot_noise = 0;
  return profile_of(camera.view);
}

struct Decoded {
  std::vector<float> distance, amplitude, sigma;
  std::vector<std::uint16_t> flags;
};

template <class T = float>
Decoded decode(const std::string& stage, const Steps& steps, const std::vector<T>& samples, double read_noise = 1) {
  const std::size_t pixels = samples.size() / steps.size();
  tofgraph::Harness harness(stage);
  harness.camera(profile(steps, pixels, read_noise));
  harness.put<T>("phases", {steps.size(), rows_of(pixels), pixels / rows_of(pixels)}, samples);
  harness.run();
  return {harness.get<float>("distance"), harness.get<float>("amplitude"), harness.get<float>("sigma"),
          harness.get<std::uint16_t>("flags")};
}

inline std::vector<double> ramp(double from, double to, std::size_t count) {
  std::vector<double> all;
  for (std::size_t i = 0; i < count; ++i)
    all.push_back(from + (to - from) * static_cast<double>(i) / static_cast<double>(count - 1));
  return all;
}

/// Least squares by QR of an independent library, in double: x, y, offset.
inline Eigen::Vector3d min_squares(const Steps& steps, const std::vector<double>& c) {
  Eigen::MatrixXd design(static_cast<Eigen::Index>(steps.size()), 3);
  Eigen::VectorXd right(design.rows());
  for (Eigen::Index k = 0; k < design.rows(); ++k) {
    const double phase = steps[static_cast<std::size_t>(k)].phase;
    design.row(k) << std::cos(phase), -std::sin(phase), 1;
    right[k] = c[static_cast<std::size_t>(k)];
  }
  return design.colPivHouseholderQr().solve(right);
}

}  // namespace test
