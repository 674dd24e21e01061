// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Held-out errors of an offset table: each level of an axis is held out in turn.
#pragma once

#include "calibration/board_measurements.hpp"
#include "calibration/interval.hpp"

#include <tofgraph/physics/offset_table.hpp>

#include <string>
#include <vector>

namespace tofgraph::calibration {

/// Prediction of a board by a table without its level.
struct Prediction {
  std::size_t board;  ///< index in Boards::boards
  double before;      ///< m, z - T
  double after;       ///< m, predicted T minus T
};

/// Levels of one axis, each held out once. The outermost levels are not predicted, because that would be extrapolation.
struct HeldOut {
  std::string axis;  ///< distance, target, integration_time
  std::size_t levels = 0;
  std::vector<Prediction> predictions;
  Interval before, after;  ///< m, root mean square; intervals by resampling whole levels
};

/// Samples of the table, one per board.
std::vector<physics::OffsetSample> samples_of(const Boards& boards);

/// Held-out predictions per axis, except axes with fewer than three levels and targets of unknown reflectivity.
std::vector<HeldOut> hold_out(const Boards& boards);

}  // namespace tofgraph::calibration
