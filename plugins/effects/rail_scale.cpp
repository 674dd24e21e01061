// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Scale error of the rail.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// Z -> (1 + scale) Z for boards, unless the distance was measured with another instrument.
struct RailScale final : Effect {
  static constexpr EffectInfo info{.touches = "distance amplitude",
                                   .confused_with = "modulation_frequency",
                                   .experiment = "a standard of length that does not depend on the rail",
                                   .scope = TOFGRAPH_SCOPE_SETUP};
  Param<double> scale{
      this,
      "scale",
      {.default_value = "0", .min = -0.1, .max = 0.1, .text = "of the distances, relative", .off = 0, .typical = 1e-3}};

  void apply(GeometryLevel& light) const {
    if ((light.condition().flags & TOFGRAPH_CONDITION_LASER) == 0) light.state.scale += *scale;
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::RailScale, "Wrong scale of the rail")
