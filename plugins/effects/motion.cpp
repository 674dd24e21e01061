// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The board moves between the phase images.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// Image k sees the scene k displacements farther away, in phase and light. If a velocity is stated, the displacement
/// is that at 100 mm/s and scales with the velocity.
struct Motion final : Effect {
  static constexpr EffectInfo info{.touches = "distance amplitude null1 null2 variance",
                                   .confused_with = "phase_step_error",
                                   .experiment = "a static repeat (velocity: 0 mm/s); a series of velocities",
                                   .scope = TOFGRAPH_SCOPE_SETUP};
  Param<double> displacement{this,
                             "displacement",
                             {.unit = "m",
                              .default_value = "0 mm",
                              .min = -0.1,
                              .max = 0.1,
                              .text = "from one phase image to the next, positive away from the camera",
                              .off = 0,
                              .typical = 1e-3}};

  void apply(SamplesLevel& light) const {
    const double velocity = light.condition().velocity;
    const double step = std::isnan(velocity) ? *displacement : *displacement * velocity / 0.1;
    if (step == 0) return;
    for (std::uint32_t k = 1; k < light.exposures(); ++k) light.displace(k, k * step);
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::Motion, "The board moves between the phase images")
