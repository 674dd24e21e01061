// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Independent implementation of a camera of 16 x 12 pixels with one lamp in front of boards: no formula is
/// shared with the project. For tests that include <hdf5.h> themselves.
#pragma once

#include "tests/program.hpp"
#include "tests/unit/raw_capture.hpp"

#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

namespace tofgraph::tests {

inline constexpr std::size_t small_columns = 16, small_rows = 12, small_pixels = small_columns * small_rows;

inline const std::string small_profile =
    "profile: 1\nname: small\nwidth: 16\nheight: 12\npixel_pitch: 400 um\nfocal_length: 12.8 mm\n"
    "principal_point: [7.5, 5.5]\ndistortion: [0, 0, 0, 0, 0]\nmodulation_frequency: 20 MHz\n"
    "sources: [{name: lamp, position: [30 mm, 0 mm, 0 mm], amplitude: 1}]\nintegration_time: [0.1 ms, 50 ms]\n"
    "frame_rate: 20 Hz\ngain: 7.0e6 counts m^2/s\ncontrast: 0.5\nread_noise: 3 counts\nshot_noise: 0.012 counts\n"
    "full_well: 30000 counts\n";

/// Half path from the lamp via a perpendicular board at z and through the lens to the pixel, m.
inline double small_half_path(std::size_t pixel, double z) {
  constexpr double focal = 12.8e-3, pitch = 400e-6, lamp = 30e-3;
  const double x = (static_cast<double>(pixel % small_columns) - 7.5) * pitch;
  const double y = (static_cast<double>(pixel / small_columns) - 5.5) * pitch;
  const double inside = std::sqrt(x * x + y * y + focal * focal), path = (z - focal) * inside / focal;
  const double px = path * x / inside, py = path * y / inside;
  return (std::sqrt((px - lamp) * (px - lamp) + py * py + z * z) + path + inside) / 2;
}

/// A recording of a board.
struct SmallBoard {
  double distance = 1;  ///< m
  std::size_t frames = 2;
  std::string serial = {};
  std::string recorded_at_ns = {};  ///< empty: 1970
  double temperature_c = std::nan(""), time_since_power_on = std::nan("");
  double noise = 0;  ///< m, standard deviation of a pixel in one frame
  std::function<double(std::size_t pixel)> error = [](std::size_t) { return 0.0; };  ///< m, of the half path
};

/// Writes distance and amplitude; reflectivity 0.5, 1 ms.
inline void record_small(const std::filesystem::path& path, const SmallBoard& board) {
  std::filesystem::create_directories(path.parent_path());
  RawCapture capture(path);
  if (!board.serial.empty()) capture.text("serial", board.serial);
  capture.head(small_columns, small_rows, 1, "tofgraph-capture", "small");
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  std::vector<float> distances, amplitudes;
  for (std::size_t i = 0; i < board.frames * small_pixels; ++i) {
    const double d = small_half_path(i % small_pixels, board.distance);
    distances.push_back(static_cast<float>(d + board.error(i % small_pixels) + board.noise * normal(random)));
    amplitudes.push_back(static_cast<float>(7.0e6 * 0.5 * 1e-3 / (4 * d * d)));
  }
  const hsize_t n = board.frames;
  capture.dataset("distance", {n, small_rows, small_columns}, distances, {1, small_rows, small_columns});
  capture.dataset("amplitude", {n, small_rows, small_columns}, amplitudes, {1, small_rows, small_columns});
  const std::int64_t start = board.recorded_at_ns.empty() ? 1'000'000'000 : std::stoll(board.recorded_at_ns);
  std::vector<std::int64_t> stamps;
  for (std::size_t i = 0; i < board.frames; ++i) stamps.push_back(start + 50'000'000 * static_cast<std::int64_t>(i));
  capture.dataset("timestamp_ns", {n}, stamps);
  capture.dataset("integration_time_s", {n}, std::vector<double>(board.frames, 1e-3));
  capture.dataset("modulation_frequency_hz", {n}, std::vector<double>(board.frames, 20e6));
  capture.dataset("temperature_c", {n}, std::vector<float>(board.frames, static_cast<float>(board.temperature_c)));
  capture.dataset("time_since_power_on_s", {n}, std::vector<double>(board.frames, board.time_since_power_on));
}

}  // namespace tofgraph::tests
