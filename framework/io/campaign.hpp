// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Campaigns: measured or simulated data with the truth of its scene. Opens no capture.
#pragma once

#include "io/condition.hpp"

#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::io {

/// Pattern for the calibration of a lens.
struct Pattern {
  /// charuco: a chessboard with markers of OpenCV in its bright squares; circles: in a grid; asymmetric_circles: every
  /// other row shifted by half the distance between columns, as OpenCV numbers them.
  enum class Type { chessboard, charuco, circles, asymmetric_circles };
  std::int64_t columns = 0, rows = 0;  ///< inner corners of the chessboard, circles
  double square = 0;                   ///< m, of circles their spacing
  Type type = Type::chessboard;
  double marker = 0;       ///< m, side of a charuco's marker
  std::string dictionary;  ///< for a charuco: 4x4_50, ...
  double diameter = 0;     ///< m, of circles
  config::Position at;     ///< position in the file
};

/// The dictionaries of markers that a charuco may have, as OpenCV has them.
const std::vector<std::string>& marker_dictionaries();

struct Campaign {
  std::string name;
  std::vector<std::string> notes;             ///< remarks for readers of results from these data
  std::string camera_name;                    ///< as written: a profile's name, or a path relative to the campaign
  io::CameraPtr camera;                       ///< always there in a campaign without mistakes
  std::optional<config::Value> camera_value;  ///< the same at its place in the file
  std::filesystem::path source;               ///< the campaign that a pipeline made this one from; empty: measured
  std::optional<Pattern> pattern;
  double jitter = std::numeric_limits<double>::infinity();  ///< m, scale of the boards' position errors; inf: unstated
  std::vector<Condition> conditions;                        ///< in the order of the file; of a table one a row
  std::string corrected_with;  ///< for a table: the model behind measured.depth; empty: not stated
  bool from_table = false;     ///< statistics only, no captures
};

/// Treatment of a missing capture: an error, or left to the code that opens it.
enum class Captures { must_be_there, may_be_missing };

/// Reads a campaign: `conditions`, whose captures and scenes must be there, or a `table`. Mistakes go to the
/// diagnostics, those of a table with its line and column; the result is then not to be used.
Campaign read_campaign(const config::Value& document, config::Diagnostics& diagnostics,
                       Captures captures = Captures::must_be_there);
/// @throws config::ConfigurationError when the file cannot be read or is not YAML
Campaign read_campaign(const std::filesystem::path& file, config::Diagnostics& diagnostics,
                       Captures captures = Captures::must_be_there);

/// Warns of targets that one or two conditions have and that are written nearly like one that many have: gray among
/// grey. Not of those that differ in their numbers alone.
void warn_of_targets(const Campaign& campaign, config::Diagnostics& diagnostics);

/// Writes a campaign of conditions, whole or not at all; read again it has the same values to the last bit. Captures,
/// scenes and the source are written relative to the file's folder.
/// @throws std::runtime_error when it cannot be written
/// @throws std::invalid_argument for statistics from a table
void write_campaign(const Campaign& campaign, const std::filesystem::path& file);

namespace detail {
/// The rows of `table:`. Part of read_campaign.
void read_table(const config::Value& table, Campaign& campaign, config::Diagnostics& diagnostics);
/// Why a board cannot stand at this distance of this camera, or nothing.
std::string distance_problem(double distance, const io::Camera* camera);
}  // namespace detail

}  // namespace tofgraph::io
