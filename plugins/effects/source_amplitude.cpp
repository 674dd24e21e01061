// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// One LED array is brighter than the other.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// Right (x > 0): 1 + ratio/2, left: 1 - ratio/2.
struct SourceAmplitude final : Effect {
  static constexpr EffectInfo info{.touches = "amplitude intensity distance",
                                   .confused_with = "source_position",
                                   .experiment = "frames with one source at a time"};
  Param<double> ratio{this,
                      "ratio",
                      {.default_value = "0",
                       .min = -1.9,
                       .max = 1.9,
                       .text = "relative excess brightness of the right source",
                       .off = 0,
                       .typical = 0.1}};

  void apply(PhasorLevel& light) const {
    for (std::size_t s = 0; s < light.size(); ++s) {
      const double x = light[s].source.position[0];
      if (light[s].from_inside() || x == 0) continue;
      const double factor = x > 0 ? 1 + *ratio / 2 : 1 - *ratio / 2;
      for (std::size_t i = 0; i < light.points(); ++i) light[s].scale(i, factor);
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::SourceAmplitude, "Unequal brightness of the sources")
