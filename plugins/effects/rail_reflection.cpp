// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The rail or table below the axis reflects light of the sources onto the board.
#include <tofgraph/effect.hpp>
#include <tofgraph/physics/geometry.hpp>

namespace tofgraph {

/// Each source has a mirror image at y' = 2 h - y (y points down, camera without roll), whose light is added, also to
/// the intensity: P += strength a_s e^(j w/c (|P - S'| + D_ref + D_sen)); no effect if the rail is covered.
struct RailReflection final : Effect {
  static constexpr EffectInfo info{.touches = "distance amplitude intensity",
                                   .confused_with = "board_tilt rail_offset warm_up",
                                   .experiment = "black cloth on the rail; the rig raised",
                                   .scope = TOFGRAPH_SCOPE_SETUP};
  Param<double> strength{
      this,
      "strength",
      {.default_value = "0", .min = 0, .max = 1, .text = "of the direct light", .off = 0, .typical = 0.03}};
  Param<double> height{this,
                       "height",
                       {.unit = "m",
                        .default_value = "0.4 m",
                        .min = 0.01,
                        .max = 10,
                        .text = "h, of the axis above the rail",
                        .typical = 0.4}};

  void apply(PhasorLevel& light) const {
    if (*strength == 0 || (light.condition().flags & TOFGRAPH_CONDITION_RAIL_COVERED) != 0) return;
    const double radians_per_path = light.radians_per_metre() / 2;
    // The rail stays below the board if the camera rolls; this is its normal in the camera's frame.
    const double down[] = {std::sin(light.condition().roll), std::cos(light.condition().roll)};
    for (std::size_t s = 0; s < light.size(); ++s) {
      const SourceLight source = light[s];
      if (source.from_inside()) continue;
      const double* from = source.source.position;
      const double beyond = 2 * (*height - down[0] * from[0] - down[1] * from[1]);
      const double image[] = {from[0] + beyond * down[0], from[1] + beyond * down[1], from[2]};
      for (std::size_t i = 0; i < light.points(); ++i) {
        if (source.strength[i] == 0) continue;
        const double* at = light.state.position + 3 * i;
        const double mirrored = physics::norm({at[0] - image[0], at[1] - image[1], at[2] - image[2]});
        // the direct light, rotated by the phase of the path difference
        source.phasor[i] *= 1.0 + std::polar(*strength, radians_per_path * (mirrored - source.source.path[i]));
        source.strength[i] *= 1 + *strength;
      }
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::RailReflection, "Light from the mirror image of the sources in the rail")
