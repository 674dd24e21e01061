// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Boards that did not stand where the campaign says.
#pragma once

#include "calibration/board_measurements.hpp"

#include <vector>

namespace tofgraph::calibration {

/// A board whose depth the others do not predict.
struct OutlyingBoard {
  std::size_t board;  ///< in Boards::boards
  double error;       ///< m, its z - T minus what the boards at other distances predict
  double usual;       ///< m, robust standard deviation of all boards' errors
};

/// Predicts z - T of each board from those at other distances, by what a camera's error may consist of: a constant, a
/// slope, harmonics of the phase, and what goes with integration time, light and target, each with a prior of the size
/// that cameras have. So the outermost boards are judged, too. One is named whose error is 5 mm or more and 6 standard
/// deviations, and three times those of the boards beside it; it is left out then, and the others are judged again.
/// None where fewer than six distances were measured, or where all differ.
std::vector<OutlyingBoard> outlying_boards(const Boards& boards, double unambiguous_range);

}  // namespace tofgraph::calibration
