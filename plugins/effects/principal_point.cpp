// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The principal point differs from the profile.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// Adds an offset to the principal point of the profile.
struct PrincipalPoint final : Effect {
  static constexpr EffectInfo info{
      .touches = "distance amplitude",
      .confused_with = "board_tilt",
      .experiment = "roll of the camera by 180 deg: a tilt turns, this does not; corners of a chessboard"};
  Param<double> x{this,
                  "x",
                  {.unit = "px",
                   .default_value = "0 px",
                   .min = -100,
                   .max = 100,
                   .text = "to the right",
                   .off = 0,
                   .typical = 1.2}};
  Param<double> y{
      this,
      "y",
      {.unit = "px", .default_value = "0 px", .min = -100, .max = 100, .text = "downwards", .off = 0, .typical = 1.2}};

  void apply(GeometryLevel& light) const {
    light.state.principal_point[0] += *x;
    light.state.principal_point[1] += *y;
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::PrincipalPoint, "A different principal point")
