// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Zero offset of the rail.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// Z -> Z + offset for boards, unless the distance was measured with another instrument.
struct RailOffset final : Effect {
  static constexpr EffectInfo info{.touches = "distance amplitude",
                                   .confused_with = "fixed_pattern source_position warm_up",
                                   .experiment = "a standard of length; the amplitude over the distance",
                                   .scope = TOFGRAPH_SCOPE_SETUP};
  Param<double> offset{this,
                       "offset",
                       {.unit = "m",
                        .default_value = "0 mm",
                        .min = -1,
                        .max = 1,
                        .text = "of the distances",
                        .off = 0,
                        .typical = 5e-3}};

  void apply(GeometryLevel& light) const {
    if ((light.condition().flags & TOFGRAPH_CONDITION_LASER) == 0) light.state.offset += *offset;
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::RailOffset, "Wrong zero of the rail")
