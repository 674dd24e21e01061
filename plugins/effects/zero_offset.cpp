// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// An electronic delay, or a different reference plane for distances.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// D += offset, before wrapping.
struct ZeroOffset final : Effect {
  static constexpr EffectInfo info{
      .touches = "distance",
      .confused_with = "rail_offset phase_step_error integration_time_offset",
      .experiment = "the zero of the rig by another instrument; a board nearer than 1 m with two arrays of sources"};
  Param<double> offset{this,
                       "offset",
                       {.unit = "m",
                        .default_value = "0 mm",
                        .min = -100,
                        .max = 100,
                        .text = "added to the half path",
                        .off = 0,
                        .typical = 20e-3}};

  void apply(PhasorLevel& light) const {
    if (*offset == 0) return;
    const double turn = *offset * light.radians_per_metre();
    for (std::size_t i = 0; i < light.points(); ++i) light.phase_offset(i) += turn;
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::ZeroOffset, "Constant offset of the distance")
