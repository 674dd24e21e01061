// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Light reflected by an object fixed to the camera: a window, the floor of the rig.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// P += strength t_int e^(j distance / K), the same for all pixels; strength t_int is added to the intensity. Absent
/// with a capped lens.
struct StaticReflection final : Effect {
  static constexpr EffectInfo info{
      .touches = "distance amplitude intensity",
      .confused_with = "crosstalk",
      .experiment = "a capped lens, with which only crosstalk stays; covering what stands in front of the camera"};
  Param<double> strength{this,
                         "strength",
                         {.unit = "counts/s",
                          .default_value = "0 counts/s",
                          .min = 0,
                          .max = 1e8,
                          .text = "its amplitude for a second of integration",
                          .off = 0,
                          .typical = 1500}};
  Param<double> distance{this,
                         "distance",
                         {.unit = "m",
                          .default_value = "200 mm",
                          .min = 0,
                          .max = 100,
                          .text = "half of the path of its light",
                          .typical = 0.2}};

  void apply(PhasorLevel& light) const {
    if (*strength == 0 || (light.condition().flags & TOFGRAPH_CONDITION_LENS_CAPPED) != 0) return;
    const double amount = *strength * light.condition().integration_time;
    const std::complex<double> added = std::polar(amount, *distance * light.radians_per_metre());
    const SourceLight inside = light[light.size() - 1];
    for (std::size_t i = 0; i < light.points(); ++i) {
      inside.phasor[i] += added;
      inside.strength[i] += amount;
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::StaticReflection, "Light from something that is fixed to the camera")
