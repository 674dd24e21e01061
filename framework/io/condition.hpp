// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Condition of a measurement or a simulation: the scene and the camera's settings.
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

/// A window of the image, first and last inclusive.
struct Roi {
  std::uint32_t first_column = 0, last_column = 0, first_row = 0, last_row = 0;
};

/// Measurement in a table: statistics over the window, NaN where the table has no such column.
struct Measured {
  double depth = unknown, depth_sd = unknown;  ///< m; mean after the correction, and the pixels' spread
  double distance = unknown;                   ///< m, mean of the raw half paths
  double amplitude = unknown;                  ///< counts
  double count = unknown;                      ///< number of values in the mean
  double frames = unknown;                     ///< number of frames that each pixel is the mean of
  double reach = unknown;                      ///< m: pixels farther from the middle are not in depth_sd; NaN: all are
};

/// Settings of a condition. SI; angles in rad, temperatures in K; NaN: not known.
struct Condition {
  std::string id;
  config::Position at;                                          ///< position in the file, for messages
  std::map<std::string, config::Position, std::less<>> places;  ///< positions of values and board's distance, by key

  // What stood there.
  double board_distance = unknown;                  ///< m, sensor plane to board on the axis; NaN: there is no board
  double board_tilt_x = unknown;                    ///< rad, R = R_y(tilt_y) R_x(tilt_x)
  double board_tilt_y = unknown;                    ///< rad
  std::optional<std::array<double, 2>> board_size;  ///< m; none: it fills the view
  std::string target;                               ///< label; conditions with one label share one reflectivity
  double reflectivity = unknown;                    ///< 0..1
  std::filesystem::path scene;                      ///< a scene file for anything but a board; empty: none

  // How it was looked at.
  double integration_time = unknown;     ///< s
  std::vector<std::string> sources;      ///< names of those that are on; empty: all of the profile's
  std::string ambient = "dark";          ///< dark, or a label
  double time_since_power_on = unknown;  ///< s
  double roll = 0;                       ///< rad, camera about its axis, right-handed
  double velocity = unknown;             ///< m/s, board along z, away positive
  std::string session;                   ///< a label; between labels the setup may have moved; empty: not stated
  std::string reference;                 ///< rail, laser; empty: not stated
  std::string lens;                      ///< open, capped; empty: not stated
  std::string rail;                      ///< bare, covered; empty: not stated
  double temperature = unknown;          ///< K

  // What came out.
  std::filesystem::path capture;                       ///< empty: none
  std::filesystem::path campaign;                      ///< of campaigns that were joined: its own; empty: not joined
  std::optional<std::array<std::uint64_t, 2>> frames;  ///< first and last; none: all
  std::optional<Roi> roi;                              ///< none: the whole image
  std::optional<std::uint64_t> order;                  ///< place in the order measured; none: as written
  std::string recorded_at;                             ///< begin of the first frame, UTC, ISO 8601; empty: not stated
  Measured measured;

  /// Position of a key's value in the file; of the condition if it does not state the key.
  const config::Position& place(std::string_view key) const {
    const auto found = places.find(key);
    return found == places.end() ? at : found->second;
  }
  bool is_capped() const { return lens == "capped"; }
  bool has_board() const { return !std::isnan(board_distance); }
};

/// First and last of a list of two whole numbers, e.g. `[0, 19]`; a mistake otherwise. @param max largest last
std::optional<std::array<std::uint64_t, 2>> read_span(const config::Entry& entry, std::uint64_t max,
                                                      std::string_view example, config::Diagnostics& diagnostics);

/// Reads names of the sources that are on, separated by blanks, or `both`: all of them. Names that the camera does not
/// have are mistakes. @param camera null: not checked
void read_source_words(const std::string& words, const config::Position& at, const io::Camera* camera,
                       std::vector<std::string>& sources, config::Diagnostics& diagnostics);

/// The keys that read_settings knows.
const std::vector<std::string>& setting_keys();

/// Reads the keys of "how it was looked at", and `target`, which are the same in campaigns and scenes.
/// @param camera knows the sources' names; null: they are not checked
void read_settings(config::Reader& reader, const config::Value& map, const io::Camera* camera, Condition& condition,
                   config::Diagnostics& diagnostics);

}  // namespace tofgraph::io
