// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The board is less perpendicular than stated.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// Rotates boards, whatever their own tilt, by R_y(y) R_x(x).
struct BoardTilt final : Effect {
  static constexpr EffectInfo info{
      .touches = "distance amplitude",
      .confused_with = "principal_point source_phase",
      .experiment = "roll of the camera by 180 deg: a tilt turns, the principal point does not",
      .scope = TOFGRAPH_SCOPE_SETUP};
  Param<double> x{
      this,
      "x",
      {.unit = "rad", .default_value = "0 rad", .min = -1, .max = 1, .text = "about x", .off = 0, .typical = 5e-3}};
  Param<double> y{
      this,
      "y",
      {.unit = "rad", .default_value = "0 rad", .min = -1, .max = 1, .text = "about y", .off = 0, .typical = 5e-3}};

  void apply(GeometryLevel& light) const {
    light.state.tilt[0] += *x;
    light.state.tilt[1] += *y;
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::BoardTilt, "Tilt of the board")
