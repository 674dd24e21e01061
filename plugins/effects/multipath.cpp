// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Part of the light takes a longer path.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// P += strength P e^(j Delta), Delta = 2 pi f extra_path / c; the light increases by the factor 1 + strength.
struct Multipath final : Effect {
  static constexpr EffectInfo info{.touches = "distance amplitude intensity",
                                   .confused_with = "stray_light rail_offset",
                                   .experiment = "an open against a closed corner; one wall blackened",
                                   .scope = TOFGRAPH_SCOPE_SETUP};
  Param<double> strength{
      this,
      "strength",
      {.default_value = "0", .min = 0, .max = 1, .text = "of the direct light", .off = 0, .typical = 0.03}};
  Param<double> extra_path{this,
                           "extra_path",
                           {.unit = "m",
                            .default_value = "0.5 m",
                            .min = 0,
                            .max = 20,
                            .text = "how much longer the whole path is",
                            .typical = 0.5}};

  void apply(PhasorLevel& light) const {
    if (*strength == 0) return;
    // radians_per_metre() refers to half of a path
    const std::complex<double> factor = 1.0 + std::polar(*strength, *extra_path / 2 * light.radians_per_metre());
    for (std::size_t s = 0; s < light.size(); ++s) {
      if (light[s].from_inside()) continue;
      for (std::size_t i = 0; i < light.points(); ++i) {
        light[s].phasor[i] *= factor;
        light[s].strength[i] *= 1 + *strength;
      }
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::Multipath, "Light on a longer path")
