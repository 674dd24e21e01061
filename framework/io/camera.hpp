// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Camera profile that owns the memory referenced by the struct of the plugin interface.
#pragma once

#include "io/unknown.hpp"

#include <tofgraph/plugin.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace tofgraph::io {

struct CameraFolder;

/// Data-sheet properties that no stage needs. NaN or empty: not stated.
struct DataSheet {
  std::string sensor, interface;
  std::array<double, 2> measuring_range = {unknown, unknown};  ///< m
  std::array<double, 2> field_of_view = {unknown, unknown};    ///< rad, horizontal and vertical
};

class Camera {
 public:
  explicit Camera(const tofgraph_camera& camera);  ///< deep copy; computes the rays if they are null
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;

  const tofgraph_camera& view() const { return view_; }
  /// Copies the bad-pixel map of a camera of the same size.
  void keep_bad_pixels(const Camera& other) {
    if (other.view_.width != view_.width || other.view_.height != view_.height) return;
    bad_pixels = other.bad_pixels;
    bad_pixels_file = other.bad_pixels_file;
    missing_bad_pixels = other.missing_bad_pixels;
  }
  std::filesystem::path file;         ///< profile file; empty: not from a file
  std::vector<std::string> measured;  ///< keys whose values were measured on a device
  std::vector<std::string> assumed;   ///< keys whose values are assumed, without a source
  DataSheet data_sheet;
  std::vector<std::uint8_t> bad_pixels;        ///< per pixel, row-major, nonzero: bad; empty: no map in the profile
  std::filesystem::path bad_pixels_file;       ///< file of the map; empty: none
  std::shared_ptr<const CameraFolder> folder;  ///< device folder of the profile; null: none
  std::string missing_bad_pixels;              ///< map that a recorded profile names but is missing; empty: none

  bool is_bad(std::size_t pixel) const { return !bad_pixels.empty() && bad_pixels[pixel] != 0; }

 private:
  tofgraph_camera view_;
  std::string name_, profile_, model_;
  std::vector<std::string> light_names_;
  std::vector<tofgraph_light> lights_;
  std::vector<tofgraph_exposure> exposures_;
  std::vector<float> rays_;
};

using CameraPtr = std::shared_ptr<const Camera>;

}  // namespace tofgraph::io
