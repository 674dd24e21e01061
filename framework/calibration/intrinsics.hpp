// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The kind `intrinsics`: what came out, for its file and its report.
#pragma once

#include "calibration/calibrate.hpp"
#include "calibration/lens_distances.hpp"
#include "calibration/lens_views.hpp"

namespace tofgraph::calibration {

/// A lens and what it is worth.
struct Intrinsics {
  LensViews views;
  LensOptions options;
  LensSolution alone;  ///< from corners, where distances were used too
  LensSolution joint;  ///< with distances, where there are any, whether they are used or not
  LensSolution solution;
  DistanceCheck distances;  ///< decides whether they are used
  TwoSets halves;
  HeldOutViews held_out;
  Structure lens, board;
  NextView next;
};

/// @param verdict the sentence at the top @param lines the summary
report::Page intrinsics_report(const std::string& camera, const Intrinsics& result, const std::string& verdict,
                               const std::string& severity, const std::vector<std::string>& lines);

/// Tilts of a board about x and y, rad, as boards are tilted in scenes: R_y R_x.
std::array<double, 2> tilts_of(const Pose& pose);

}  // namespace tofgraph::calibration
