// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Held-out errors of an offset table: each level of an axis is left out in turn.
#pragma once

#include "calibration/boards.hpp"
#include "calibration/interval.hpp"

#include <tofgraph/physics/offset_table.hpp>

#include <string>
#include <vector>

namespace tofgraph::calibration {

/// Prediction of a board by a table made without its level.
struct Prediction {
  std::size_t board;  ///< in Boards::boards
  double before;      ///< m, z - T
  double after;       ///< m, predicted T minus T
};

/// The levels of one axis, each left out once. The outermost levels are not predicted: that would be extrapolation.
struct HeldOut {
  std::string axis;  ///< distance, target, integration_time
  std::size_t levels = 0;
  std::vector<Prediction> predictions;
  Interval before, after;  ///< m, root mean square; intervals by resampling whole levels
};

/// The samples that a table is made of, one a board.
std::vector<physics::OffsetSample> samples_of(const Boards& boards);

/// Axes with fewer than three levels are left out, and targets whose reflectivities are not known.
std::vector<HeldOut> hold_out(const Boards& boards);

}  // namespace tofgraph::calibration
