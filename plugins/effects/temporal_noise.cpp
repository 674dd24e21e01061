// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The noise is larger than in the profile.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// Multiplies the standard deviation of a tap by a factor.
struct TemporalNoise final : Effect {
  static constexpr EffectInfo info{.touches = "variance",
                                   .confused_with = "motion",
                                   .experiment = "the variance as a function of the intensity: slope and intercept"};
  Param<double> factor{
      this,
      "factor",
      {.default_value = "1", .min = 0, .max = 1000, .text = "of the standard deviation", .off = 1, .typical = 2}};

  void apply(TapsLevel& light) const { light.state.noise_factor *= *factor; }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::TemporalNoise, "More or less noise")
