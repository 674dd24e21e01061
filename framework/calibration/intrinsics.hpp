// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The kind `intrinsics`: what came out, for its file and its report.
#pragma once

#include "calibration/calibrate.hpp"
#include "calibration/lens_views.hpp"

namespace tofgraph::calibration {

/// A lens and what it is worth.
struct Intrinsics {
  LensViews views;
  LensOptions options;
  LensSolution alone;  ///< from corners, where distances were used too
  LensSolution solution;
  TwoSets halves;
  HeldOutViews held_out;
  Structure lens, board;
  NextView next;
};

report::Page intrinsics_report(const std::string& camera, const Intrinsics& result, const std::string& verdict,
                               const std::string& severity, const std::vector<std::string>& notes);

/// `looking down by 20 deg, ...`: tilts of a board about the image's axes, rad.
std::array<double, 2> tilts_of(const Pose& pose);

}  // namespace tofgraph::calibration
