// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The sources emit less light off their axes.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// Each source *= cos^n of the angle from its axis, which is z turned outwards (away from x = 0) by `toe`. A source at
/// x = 0 has the axis z.
struct BeamProfile final : Effect {
  static constexpr EffectInfo info{.touches = "amplitude intensity",
                                   .confused_with = "vignetting pixel_response surface_reflectance",
                                   .experiment = "short distances, tilts, one source at a time"};
  Param<double> exponent{
      this, "exponent", {.default_value = "0", .min = -50, .max = 200, .text = "n", .off = 0, .typical = 2}};
  Param<double> toe{this,
                    "toe",
                    {.unit = "rad",
                     .default_value = "0 rad",
                     .min = -1,
                     .max = 1,
                     .text = "tilt of each axis, outwards",
                     .off = 0,
                     .typical = 20e-3,
                     .nested = true}};

  void apply(PhasorLevel& light) const {
    if (*exponent == 0) return;
    for (std::size_t s = 0; s < light.size(); ++s) {
      const SourceLight source = light[s];
      if (source.from_inside()) continue;
      const double* from = source.source.position;
      const double outwards = from[0] > 0 ? *toe : from[0] < 0 ? -*toe : 0;
      const double axis_x = std::sin(outwards), axis_z = std::cos(outwards);
      for (std::size_t i = 0; i < light.points(); ++i) {
        const double* at = light.state.position + 3 * i;
        const double path = source.source.path[i];
        if (!(path > 0) || source.strength[i] == 0) continue;
        const double cosine = (axis_x * (at[0] - from[0]) + axis_z * (at[2] - from[2])) / path;
        source.scale(i, cosine > 0 ? std::pow(cosine, *exponent) : 0.0);
      }
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::BeamProfile, "Angular profile of the sources")
