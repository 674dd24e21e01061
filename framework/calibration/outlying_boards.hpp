// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Detection of boards that were not at their stated position.
#pragma once

#include "calibration/board_measurements.hpp"

#include <vector>

namespace tofgraph::calibration {

/// Board whose depth contradicts the prediction from the others.
struct OutlyingBoard {
  std::size_t board;  ///< index in Boards::boards
  double error;       ///< m, its z - T minus the prediction from boards at other distances
  double usual;       ///< m, robust standard deviation of all boards' errors
};

/// Predicts z - T of each board from those at other distances by a model of camera errors: a constant, a slope,
/// harmonics of the phase, and terms of integration time, light and target, each with a prior of typical magnitude.
/// So the outermost boards are tested too. A board is reported if its error is at least 5 mm, 6 standard deviations and
/// three times those of the adjacent boards; it is then excluded, and the others are tested again.
/// Empty if fewer than six distances were measured, or if all differ.
std::vector<OutlyingBoard> outlying_boards(const Boards& boards, double unambiguous_range);

}  // namespace tofgraph::calibration
