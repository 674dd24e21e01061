// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The exposures of the four phase images differ.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// Image k has 1 + gain_k of the light of image 0: c_k and the intensity of that image.
struct PhaseGain final : Effect {
  static constexpr EffectInfo info{.touches = "distance amplitude intensity null1 null2",
                                   .confused_with = "phase_step_error ambient_light",
                                   .experiment = "N1 and N2; a series of ambient light"};
  Param<double> gain1{
      this,
      "gain1",
      {.fallback = "0", .min = -0.5, .max = 0.5, .text = "image 1 gets more light", .off = 0, .typical = 5e-3}};
  Param<double> gain2{
      this,
      "gain2",
      {.fallback = "0", .min = -0.5, .max = 0.5, .text = "image 2 gets more light", .off = 0, .typical = 5e-3}};
  Param<double> gain3{
      this,
      "gain3",
      {.fallback = "0", .min = -0.5, .max = 0.5, .text = "image 3 gets more light", .off = 0, .typical = 5e-3}};

  void apply(SamplesLevel& light) const {
    const double gains[] = {0, *gain1, *gain2, *gain3};
    for (std::size_t k = 1; k < std::min(light.exposures(), std::size(gains)); ++k) {
      if (gains[k] == 0) continue;
      const double factor = 1 + gains[k];
      for (std::size_t i = 0; i < light.points(); ++i) {
        light.phasor(k, i) *= factor;
        light.extra(k, i) *= factor;
        light.intensity(k, i) *= factor;
      }
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::PhaseGain, "Unequal exposures of the phase images")
