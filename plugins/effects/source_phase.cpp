// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Phase difference between the LED arrays.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// Right (x > 0): Psi + difference/2, left: Psi - difference/2.
struct SourcePhase final : Effect {
  static constexpr EffectInfo info{.touches = "distance amplitude",
                                   .confused_with = "fixed_pattern board_tilt",
                                   .experiment = "frames with one source at a time"};
  Param<double> difference{this,
                           "difference",
                           {.unit = "rad",
                            .default_value = "0 rad",
                            .min = -M_PI,
                            .max = M_PI,
                            .text = "right minus left",
                            .off = 0,
                            .typical = 50e-3}};

  void apply(PhasorLevel& light) const {
    if (*difference == 0) return;
    for (std::size_t s = 0; s < light.size(); ++s) {
      const double x = light[s].source.position[0];
      if (light[s].from_inside() || x == 0) continue;
      const std::complex<double> turn = std::polar(1.0, x > 0 ? *difference / 2 : -*difference / 2);
      for (std::size_t i = 0; i < light.points(); ++i) light[s].phasor[i] *= turn;
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::SourcePhase, "Phase between the sources")
