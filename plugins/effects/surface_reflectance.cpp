// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Reflectance as a function of the angle of incidence: Lambert, or Oren-Nayar for rough surfaces.
#include <tofgraph/effect.hpp>
#include <tofgraph/physics/reflectance.hpp>

#include <algorithm>

namespace tofgraph {

/// Each source *= (1 - l) + l cos(theta_i) f_on; f_on alone with light: physical, which includes the cosine already.
struct SurfaceReflectance final : Effect {
  static constexpr EffectInfo info{.touches = "amplitude intensity",
                                   .confused_with = "beam_profile vignetting",
                                   .experiment = "a series of tilts of +-30 deg",
                                   .scope = TOFGRAPH_SCOPE_SETUP};
  Param<double> lambert{
      this, "lambert", {.default_value = "0", .min = 0, .max = 1, .text = "l, 1: Lambert", .off = 0, .typical = 1}};
  Param<double> roughness{this,
                          "roughness",
                          {.unit = "rad",
                           .default_value = "0 rad",
                           .min = 0,
                           .max = 1.5,
                           .text = "of Oren and Nayar; 0: f_on = 1",
                           .off = 0,
                           .typical = 0.3}};

  void apply(PhasorLevel& light) const {
    const bool physical = light.state.physical != 0;
    if (*roughness == 0 && (physical || *lambert == 0)) return;
    for (std::size_t s = 0; s < light.size(); ++s) {
      const SourceLight source = light[s];
      if (source.from_inside()) continue;
      const physics::Vector3 from = at(source.source.position, 0);
      for (std::size_t i = 0; i < light.points(); ++i) {
        if (source.strength[i] == 0) continue;
        const physics::Vector3 normal = at(light.state.normal, i);
        const physics::Vector3 to_light = (1 / source.source.path[i]) * (from - at(light.state.position, i));
        const double rough = physics::oren_nayar(*roughness, normal, to_light, -1.0 * at(light.state.ray, i));
        const double cosine = std::max(0.0, physics::dot(normal, to_light));
        source.scale(i, physical ? rough : 1 - *lambert + *lambert * cosine * rough);
      }
    }
  }

 private:
  static physics::Vector3 at(const double* triple, std::size_t i) {
    return {triple[3 * i], triple[3 * i + 1], triple[3 * i + 2]};
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::SurfaceReflectance, "Light that depends on the angle of incidence: Lambert, Oren-Nayar")
