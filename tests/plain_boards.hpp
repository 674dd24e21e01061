// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Independent implementation of a nominal CamCube 2.0 in front of boards: no formula is shared with the project.
/// For tests that include <hdf5.h> themselves.
#pragma once

#include "tests/unit/raw_capture.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

namespace tofgraph::tests {

inline constexpr std::size_t plain_side = 204, plain_pixels = plain_side * plain_side;

/// A board near a distance, whose room is rotated relative to the camera by its roll; small position errors; its shape.
struct PlainBoard {
  double distance = 1, roll = 0, z = 0, tilt_x = 0, tilt_y = 0;
  std::function<double(double x, double y)> shape = [](double, double) { return 0.0; };
};

/// Half path from both lamps to the board's surface, through the lens and to the pixel, m.
inline double plain_half_path(std::size_t column, std::size_t row, const PlainBoard& board) {
  constexpr double focal = 12.8e-3, pitch = 40e-6, centre = 101.5, lamp = 50e-3;
  const double x = (static_cast<double>(column) - centre) * pitch, y = (static_cast<double>(row) - centre) * pitch;
  const double inside = std::sqrt(x * x + y * y + focal * focal);
  const double c = std::cos(board.roll), s = std::sin(board.roll);
  double path = 0, before = -1;
  // The surface is z = distance + z + tilt_x Y - tilt_y X + shape(X, Y) in the room's axes X, Y: a fixed-point
  // iteration. It is flat to a few per mille, so that a few steps converge to the last digit.
  for (int step = 0; step < 60 && std::abs(path - before) > 1e-15; ++step) {
    before = path;
    const double px = path * x / inside, py = path * y / inside;
    const double room_x = c * px - s * py, room_y = s * px + c * py;
    const double surface =
        board.distance + board.z + board.tilt_x * room_y - board.tilt_y * room_x + board.shape(room_x, room_y);
    path = (surface - focal) * inside / focal;
  }
  const double px = path * x / inside, py = path * y / inside, pz = focal + path * focal / inside;
  const double left = std::sqrt((px + lamp) * (px + lamp) + py * py + pz * pz);
  const double right = std::sqrt((px - lamp) * (px - lamp) + py * py + pz * pz);
  return ((left + right) / 2 + path + inside) / 2;
}

/// Writes frames of distance and amplitude.
inline void write_distances(const std::filesystem::path& path, const std::vector<std::vector<float>>& frames,
                            const std::vector<float>& amplitude, double integration_time,
                            const std::string& serial = {}) {
  RawCapture capture(path);
  if (!serial.empty()) capture.text("serial", serial);
  capture.head(plain_side, plain_side, 1, "tofgraph-capture", "camcube2");
  std::vector<float> distances, amplitudes;
  for (const std::vector<float>& frame : frames) {
    distances.insert(distances.end(), frame.begin(), frame.end());
    amplitudes.insert(amplitudes.end(), amplitude.begin(), amplitude.end());
  }
  const hsize_t n = frames.size();
  capture.dataset("distance", {n, plain_side, plain_side}, distances, {1, plain_side, plain_side});
  if (!amplitude.empty())
    capture.dataset("amplitude", {n, plain_side, plain_side}, amplitudes, {1, plain_side, plain_side});
  capture.metadata(frames.size(), integration_time);
}

}  // namespace tofgraph::tests
