// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Current view of a camera as numbers, for setting up a board.
#pragma once

#include "graph/runner.hpp"
#include "io/condition.hpp"
#include "recording/pipelines.hpp"

#include <array>
#include <functional>
#include <optional>
#include <string>

namespace tofgraph::recording {

/// Runs a graph to its end, or ends it when the user interrupts it. @throws Interrupted
using Run = std::function<graph::RunResult(graph::Runner&)>;
struct Interrupted {};

struct Seen {
  double distance = io::unknown;   ///< m, median depth of the image centre (21 x 21 px) over the frames
  double amplitude = io::unknown;  ///< counts, median of the image centre
  double saturated = 0;            ///< fraction of the image's pixels
  /// m, median depth of 11 x 11 px in each corner: top left, top right, bottom left, bottom right. They are equal for a
  /// board that is perpendicular to the axis (sections 5.6, 6.3 and 7.3 of the reference).
  std::array<double, 4> corners = {io::unknown, io::unknown, io::unknown, io::unknown};

  /// Largest difference between the corners, m; NaN if one of them is invalid.
  double misalignment() const;
  std::string text() const;
};

/// Measures over some frames. @throws std::runtime_error for an error of the camera @throws config::ConfigurationError
Seen look(const CameraRequest& camera, const graph::GraphOptions& options, const Run& run);

/// Reason why a board that should be perpendicular is not, or nothing. @param tolerance m, difference of the corners
std::string misaligned(const Seen& seen, double tolerance);

/// Returns whether a missing move between two planned distances can be detected: smaller changes are within the
/// variation of the distance offset. @param a, b m; NaN: unknown
bool change_shows(double a, double b);

/// Measurement of a board whose planned distance is known.
struct Reference {
  double planned = 0, seen = 0;  ///< m
};

/// Reason why the board cannot be where the plan wants it, or nothing.
/// @param before the last board of the same campaign, which has nearly the same offset: detects a board that was not
/// moved even if the camera is not calibrated
/// @param tolerance m, maximum error of an uncalibrated camera @param unambiguous_range m; NaN: unknown
std::string contradiction(const Seen& seen, double planned, const std::optional<Reference>& before, double tolerance,
                          double unambiguous_range);

}  // namespace tofgraph::recording
