// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Specular reflection: a highlight for each source in the direction of mirror reflection.
#include <tofgraph/effect.hpp>
#include <tofgraph/physics/geometry.hpp>

namespace tofgraph {

/// Each source += strength (n.h)^m times the light returned by a white surface, with h halfway between source and
/// camera; independent of the reflectivity.
struct Specular final : Effect {
  static constexpr EffectInfo info{.touches = "amplitude intensity",
                                   .confused_with = "beam_profile",
                                   .experiment = "a series of tilts; a glossy and a matt target",
                                   .scope = TOFGRAPH_SCOPE_SETUP};
  Param<double> strength{this,
                         "strength",
                         {.default_value = "0",
                          .min = 0,
                          .max = 100,
                          .text = "k_s, relative to a white surface",
                          .off = 0,
                          .typical = 0.3}};
  Param<double> exponent{this, "exponent", {.default_value = "60", .min = 1, .max = 2000, .text = "m", .typical = 60}};

  void apply(PhasorLevel& light) const {
    if (*strength == 0) return;
    for (std::size_t s = 0; s < light.size(); ++s) {
      const SourceLight source = light[s];
      if (source.from_inside()) continue;
      const physics::Vector3 from = at(source.source.position, 0);
      for (std::size_t i = 0; i < light.points(); ++i) {
        const double reflectivity = light.state.reflectivity[i];
        if (!(source.strength[i] > 0) || !(reflectivity > 0)) continue;
        const physics::Vector3 to_light = (1 / source.source.path[i]) * (from - at(light.state.position, i));
        const physics::Vector3 half = to_light - at(light.state.ray, i);
        const double along = physics::dot(at(light.state.normal, i), half) / physics::norm(half);
        if (along > 0) source.scale(i, 1 + *strength / reflectivity * std::pow(along, *exponent));
      }
    }
  }

 private:
  static physics::Vector3 at(const double* triple, std::size_t i) {
    return {triple[3 * i], triple[3 * i + 1], triple[3 * i + 2]};
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::Specular, "Gloss in the mirror direction")
