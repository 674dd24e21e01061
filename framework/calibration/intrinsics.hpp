// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Results of the kind `intrinsics`, for its file and its report.
#pragma once

#include "calibration/calibrate.hpp"
#include "calibration/lens_distances.hpp"
#include "calibration/lens_views.hpp"

namespace tofgraph::calibration {

/// Lens and its validation.
struct Intrinsics {
  LensViews views;
  LensOptions options;
  LensSolution alone;  ///< from corners only
  LensSolution joint;  ///< with distances, if there are any, even if they are then rejected
  LensSolution solution;
  DistanceCheck distances;  ///< decides if distances are used
  TwoSets halves;
  HeldOutViews held_out;
  Structure lens, board;
  NextView next;
};

/// @param verdict sentence at the top @param lines of the summary
report::Page intrinsics_report(const std::string& camera, const Intrinsics& result, const std::string& verdict,
                               const std::string& severity, const std::vector<std::string>& lines);

/// Tilts of a board about x and y, rad, in the convention of scenes: R_y R_x.
std::array<double, 2> tilts_of(const Pose& pose);

}  // namespace tofgraph::calibration
