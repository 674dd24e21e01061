// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace tofgraph::simulation {

/// Change of a scene's boards (boards, chessboards, cards) by effects and motion: z becomes scale z + offset, the board
/// is rotated by R_y(tilt_y) R_x(tilt_x), then it is displaced along z.
struct BoardChange {
  double scale = 1, offset = 0;   ///< m
  double tilt_x = 0, tilt_y = 0;  ///< rad
  double displacement = 0;        ///< m, positive away from the camera
  double time = 0;                ///< s since the start of the first exposure, for moving objects

  bool operator==(const BoardChange&) const = default;
};

}  // namespace tofgraph::simulation
