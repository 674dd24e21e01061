// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Independent implementation of a small camera with bad pixels in front of flat boards: no formula is shared
/// with the project. For tests that include <hdf5.h> themselves.
#pragma once

#include "tests/program.hpp"
#include "tests/unit/raw_capture.hpp"

#include <algorithm>
#include <cstdint>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace tofgraph::tests {

enum class PixelKind { good, dead, stuck, frozen_tap, noisy, hot, full, unmodulated };

/// A recording of a board that fills the view, perpendicular to the axis.
struct BoardShot {
  double distance = 1, time = 1e-3;  ///< m, s
  std::size_t frames = 10;
  double reflectivity = 0.8, drift = 0;  ///< drift: m, added to the half path
  double time_since_power_on = 7200;     ///< s
  double contrast = 0.5;
};

class DirtyCamera {
 public:
  /// @param side px, of a sensor of 1.92 mm
  explicit DirtyCamera(std::size_t side) : side_(side), kinds_(side * side, PixelKind::good), offset_(side * side, 0) {}

  std::size_t pixels() const { return side_ * side_; }
  PixelKind kind(std::size_t pixel) const { return kinds_[pixel]; }
  std::size_t count(PixelKind kind) const { return static_cast<std::size_t>(std::ranges::count(kinds_, kind)); }

  /// Makes this many pixels, chosen at random among the good ones, defective.
  void spoil(PixelKind kind, std::size_t count) {
    std::vector<std::size_t> good;
    for (std::size_t i = 0; i < pixels(); ++i)
      if (kinds_[i] == PixelKind::good) good.push_back(i);
    std::ranges::shuffle(good, random_);
    for (std::size_t i = 0; i < count; ++i) kinds_[good[i]] = kind;
  }

  /// Sets a fixed pattern of the half path, m, standard deviation; white.
  void set_pattern(double sd) {
    std::normal_distribution<double> normal(0, sd);
    for (double& value : offset_) value = normal(random_);
  }
  const std::vector<double>& pattern() const { return offset_; }

  /// Profile `dirty`. @param more additional lines
  std::string profile(const std::string& more = {}) const {
    const std::string n = std::to_string(side_), middle = std::to_string((static_cast<double>(side_) - 1) / 2);
    return "profile: 1\nname: dirty\nwidth: " + n + "\nheight: " + n +
           "\npixel_pitch: " + std::to_string(1e6 * pitch()) + " um\nfocal_length: 3.2 mm\nprincipal_point: [" +
           middle + ", " + middle +
           "]\nmodulation_frequency: 20 MHz\nsources:\n  - {name: left, position: [-50 mm, 0 mm, 0 mm]}\n"
           "  - {name: right, position: [50 mm, 0 mm, 0 mm]}\ngain: 7.0e6 counts m^2/s\ncontrast: 0.5\n"
           "read_noise: 3 counts\nshot_noise: 0.012 counts\nfull_well: 30000 counts\n" +
           more;
  }

  /// Half path from the lamps via the board to the pixel, m, mean of both lamps.
  double half_path(std::size_t pixel, double distance) const {
    constexpr double focal = 3.2e-3, lamp = 50e-3;
    const double middle = (static_cast<double>(side_) - 1) / 2;
    const double x = (static_cast<double>(pixel % side_) - middle) * pitch();
    const double y = (static_cast<double>(pixel / side_) - middle) * pitch();
    const double inside = std::sqrt(x * x + y * y + focal * focal), along = (distance - focal) / focal;
    const double px = along * x, py = along * y;
    const double left = std::sqrt((px + lamp) * (px + lamp) + py * py + distance * distance);
    const double right = std::sqrt((px - lamp) * (px - lamp) + py * py + distance * distance);
    return ((left + right) / 2 + along * inside + inside) / 2;
  }

  /// Counts of the taps, frames x 4 x 2 x pixels.
  std::vector<std::uint16_t> taps(const BoardShot& shot) {
    constexpr double gain = 7e6, metres_per_radian = 299792458 / (4 * std::numbers::pi * 20e6);
    std::vector<std::uint16_t> result(shot.frames * 8 * pixels());
    std::normal_distribution<double> normal;
    for (std::size_t i = 0; i < pixels(); ++i) {
      const double path = half_path(i, shot.distance);
      const double light = gain * shot.reflectivity * shot.time / (4 * path * path);
      const double phase = (path + shot.drift + offset_[i]) / metres_per_radian;
      const double contrast = kinds_[i] == PixelKind::unmodulated ? 0 : shot.contrast;
      for (std::size_t k = 0; k < 8; ++k) {
        const double swing = std::cos(phase + static_cast<double>(k / 2) * std::numbers::pi / 2);
        const double level = light * (1 + (k % 2 == 0 ? 1 : -1) * contrast * swing);
        for (std::size_t f = 0; f < shot.frames; ++f)
          result[(f * 8 + k) * pixels() + i] = counts(kinds_[i], k, level, shot.time, normal);
      }
    }
    return result;
  }

  void record(const std::filesystem::path& file, const BoardShot& shot) { write(file, shot, taps(shot)); }

 private:
  double pitch() const { return 1.92e-3 / static_cast<double>(side_); }

  std::uint16_t counts(PixelKind kind, std::size_t tap, double level, double time,
                       std::normal_distribution<double>& normal) {
    double value = level + normal(random_) * std::sqrt(9 + 0.012 * level);
    if (kind == PixelKind::dead) value = 6 + 3 * normal(random_);
    if (kind == PixelKind::stuck) value = 777;
    if (kind == PixelKind::frozen_tap && tap == 3) value = 1234;
    if (kind == PixelKind::noisy) value = level + 4 * (value - level);
    if (kind == PixelKind::hot) value += 4e6 * time;
    if (kind == PixelKind::full) value = 40000;
    return static_cast<std::uint16_t>(std::clamp(std::rint(value), 0.0, 65535.0));
  }

  void write(const std::filesystem::path& file, const BoardShot& shot,
             const std::vector<std::uint16_t>& samples) const {
    const hsize_t n = shot.frames, side = side_;
    RawCapture capture(file);
    capture.head(static_cast<std::int64_t>(side_), static_cast<std::int64_t>(side_), 1, "tofgraph-capture", "dirty");
    capture.dataset("taps", {n, 4, 2, side, side}, samples, {1, 4, 2, side, side});
    std::vector<std::int64_t> stamps;
    std::vector<double> since;
    for (std::size_t f = 0; f < shot.frames; ++f) {
      since.push_back(shot.time_since_power_on + 0.1 * static_cast<double>(f));
      stamps.push_back(static_cast<std::int64_t>(1e9 * since.back()));
    }
    capture.dataset("timestamp_ns", {n}, stamps).dataset("time_since_power_on_s", {n}, since);
    capture.dataset("integration_time_s", {n}, std::vector<double>(n, shot.time));
    capture.dataset("modulation_frequency_hz", {n}, std::vector<double>(n, 20e6));
    capture.dataset("temperature_c", {n}, std::vector<float>(n, std::nanf("")));
  }

  std::size_t side_;
  std::mt19937_64 random_{7};
  std::vector<PixelKind> kinds_;
  std::vector<double> offset_;
};

/// A campaign of such recordings in a folder.
class DirtyCampaign {
 public:
  DirtyCampaign(const std::filesystem::path& folder, std::string name) : folder_(folder), name_(std::move(name)) {}

  DirtyCampaign& add(DirtyCamera& camera, const BoardShot& shot, const std::string& more = {}) {
    const std::string id = name_ + std::to_string(count_++);
    camera.record(folder_ / (id + ".h5"), shot);
    rows_ += "  - {id: " + id + ", capture: " + id + ".h5, board: {distance: " + std::to_string(1e3 * shot.distance) +
             " mm}, integration_time: " + std::to_string(1e3 * shot.time) +
             " ms, time_since_power_on: " + std::to_string(shot.time_since_power_on) + " s" + more + "}\n";
    write_text(folder_ / (name_ + ".yaml"), "campaign: 1\ncamera: dirty.yaml\nconditions:\n" + rows_);
    return *this;
  }

 private:
  std::filesystem::path folder_;
  std::string name_, rows_;
  std::size_t count_ = 0;
};

}  // namespace tofgraph::tests
