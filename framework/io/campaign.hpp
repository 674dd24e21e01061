// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Campaigns: measured or simulated data with the ground truth of the scene. Does not open captures.
#pragma once

#include "io/condition.hpp"

#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::io {

/// Pattern for a lens calibration.
struct Pattern {
  /// charuco: a chessboard with OpenCV markers in its bright squares; circles: in a grid; asymmetric_circles: every
  /// other row shifted by half the distance between columns, numbered as in OpenCV.
  enum class Type { chessboard, charuco, circles, asymmetric_circles };
  std::int64_t columns = 0, rows = 0;  ///< inner corners of the chessboard, circles
  double square = 0;                   ///< m; for circles their spacing
  Type type = Type::chessboard;
  double marker = 0;       ///< m, side length of a charuco marker
  std::string dictionary;  ///< for a charuco: 4x4_50, ...
  double diameter = 0;     ///< m, of circles
  config::Position at;     ///< position in the file
};

/// OpenCV marker dictionaries available for a charuco.
const std::vector<std::string>& marker_dictionaries();

struct Campaign {
  std::string name;
  std::vector<std::string> notes;             ///< remarks that are shown with results from these data
  std::string camera_name;                    ///< as written: a profile's name, or a path relative to the campaign
  io::CameraPtr camera;                       ///< never null in a campaign without errors
  std::optional<config::Value> camera_value;  ///< the same with its position in the file
  std::filesystem::path source;               ///< campaign from which a pipeline made this one; empty: measured
  std::optional<Pattern> pattern;
  double jitter = std::numeric_limits<double>::infinity();  ///< m, scale of the boards' position errors; inf: unstated
  std::vector<Condition> conditions;                        ///< in the order of the file; for a table one per row
  std::string corrected_with;  ///< for a table: the model behind measured.depth; empty: not stated
  bool from_table = false;     ///< statistics only, no captures
};

/// Handling of a missing capture: an error, or left to the code that opens it.
enum class Captures { must_be_there, may_be_missing };

/// Reads a campaign: `conditions`, whose captures and scenes must exist, or a `table`. Errors are reported to the
/// diagnostics, those in a table with line and column; the result must not be used in that case.
Campaign read_campaign(const config::Value& document, config::Diagnostics& diagnostics,
                       Captures captures = Captures::must_be_there);
/// @throws config::ConfigurationError if the file cannot be read or is not YAML
Campaign read_campaign(const std::filesystem::path& file, config::Diagnostics& diagnostics,
                       Captures captures = Captures::must_be_there);

/// Warns of target labels of one or two conditions that are similar to a label of many, such as gray among grey.
/// Labels that differ only in their numbers are not reported.
void warn_of_targets(const Campaign& campaign, config::Diagnostics& diagnostics);

/// Writes a campaign of conditions atomically; reading it back gives bit-identical values. Captures, scenes and the
/// source are written relative to the file's folder.
/// @throws std::runtime_error if it cannot be written
/// @throws std::invalid_argument for statistics from a table
void write_campaign(const Campaign& campaign, const std::filesystem::path& file);

namespace detail {
/// Reads the rows of `table:`. Part of read_campaign.
void read_table(const config::Value& table, Campaign& campaign, config::Diagnostics& diagnostics);
/// Reason why a board cannot be at this distance from this camera; empty: it can.
std::string distance_problem(double distance, const io::Camera* camera);
}  // namespace detail

}  // namespace tofgraph::io
