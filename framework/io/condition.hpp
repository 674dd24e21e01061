// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Condition of a measurement or a simulation: the scene and the settings of the camera.
#pragma once

#include "config/document.hpp"
#include "io/camera.hpp"
#include "io/unknown.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph::io {

/// Region of the image; the first and last index are included.
struct Roi {
  std::uint32_t first_column = 0, last_column = 0, first_row = 0, last_row = 0;
};

/// Measurement in a table: statistics over the region, NaN if the table has no such column.
struct Measured {
  double depth = unknown, depth_sd = unknown;  ///< m; mean after the correction, and standard deviation over the pixels
  double distance = unknown;                   ///< m, mean of the raw half path lengths
  double amplitude = unknown;                  ///< counts
  double count = unknown;                      ///< number of values that were averaged
  double frames = unknown;                     ///< number of frames averaged per pixel
  double reach = unknown;                      ///< m: depth_sd excludes pixels farther from the middle; NaN: none
};

/// Settings of a condition. SI; angles in rad, temperatures in K; NaN: unknown.
struct Condition {
  std::string id;
  config::Position at;                                          ///< position in the file, for messages
  std::map<std::string, config::Position, std::less<>> places;  ///< positions of values and board's distance, by key

  // Scene.
  double board_distance = unknown;                  ///< m, sensor plane to board on the axis; NaN: there is no board
  double board_tilt_x = unknown;                    ///< rad, R = R_y(tilt_y) R_x(tilt_x)
  double board_tilt_y = unknown;                    ///< rad
  std::optional<std::array<double, 2>> board_size;  ///< m; none: it fills the image
  std::string target;                               ///< label; conditions with the same label share one reflectivity
  double reflectivity = unknown;                    ///< 0..1
  std::filesystem::path scene;                      ///< scene file for anything other than a board; empty: none

  // Settings of the camera.
  double integration_time = unknown;     ///< s
  std::vector<std::string> sources;      ///< names of the active ones; empty: all of the profile's
  std::string ambient = "dark";          ///< dark, or a label
  double time_since_power_on = unknown;  ///< s
  double roll = 0;                       ///< rad, camera about its axis, right-handed
  double velocity = unknown;             ///< m/s, board along z, positive away from the camera
  std::string session;                   ///< label; the setup may move between sessions; empty: not stated
  std::string reference;                 ///< rail, laser; empty: not stated
  std::string lens;                      ///< open, capped; empty: not stated
  std::string rail;                      ///< bare, covered; empty: not stated
  double temperature = unknown;          ///< K

  // Results.
  std::filesystem::path capture;                       ///< empty: none
  std::filesystem::path campaign;                      ///< original file if campaigns were joined; else empty
  std::optional<std::array<std::uint64_t, 2>> frames;  ///< first and last; none: all
  std::optional<Roi> roi;                              ///< none: the whole image
  std::optional<std::uint64_t> order;                  ///< rank in the measurement order; none: as in the file
  std::string recorded_at;                             ///< start of the first frame, UTC, ISO 8601; empty: not stated
  Measured measured;

  /// Position of a key's value in the file; that of the condition if the key is missing.
  const config::Position& place(std::string_view key) const {
    const auto found = places.find(key);
    return found == places.end() ? at : found->second;
  }
  bool is_capped() const { return lens == "capped"; }
  bool has_board() const { return !std::isnan(board_distance); }
};

/// First and last of a list of two integers, e.g. `[0, 19]`; anything else is an error. @param max largest last
std::optional<std::array<std::uint64_t, 2>> read_span(const config::Entry& entry, std::uint64_t max,
                                                      std::string_view example, config::Diagnostics& diagnostics);

/// Reads the names of the active sources, separated by blanks, or `both` for all of them. Names unknown to the camera
/// are errors. @param camera null: not checked
void read_source_words(const std::string& words, const config::Position& at, const io::Camera* camera,
                       std::vector<std::string>& sources, config::Diagnostics& diagnostics);

/// Keys that read_settings reads.
const std::vector<std::string>& setting_keys();

/// Reads the camera settings and `target`, whose keys are the same in campaigns and scenes.
/// @param camera its sources are the valid names; null: they are not checked
void read_settings(config::Reader& reader, const config::Value& map, const io::Camera* camera, Condition& condition,
                   config::Diagnostics& diagnostics);

}  // namespace tofgraph::io
