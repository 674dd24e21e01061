// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The two taps have different gains.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// gA = 1 + ratio/2, gB = 1 - ratio/2: N1 = ratio I, without a distance error while it is the same in all images.
struct TapMismatch final : Effect {
  static constexpr EffectInfo info{.touches = "null1",
                                   .confused_with = "pixel_response",
                                   .experiment = "the raw samples; a series of ambient light, N1 follows I"};
  Param<double> ratio{
      this,
      "ratio",
      {.default_value = "0", .min = -0.5, .max = 0.5, .text = "ratio of the gains, A to B", .off = 0, .typical = 0.02}};

  void apply(TapsLevel& light) const {
    const double gain_a = 1 + *ratio / 2, gain_b = 1 - *ratio / 2;
    for (std::size_t k = 0; k < light.exposures(); ++k) {
      for (std::size_t i = 0; i < light.points(); ++i) {
        light.a(k, i) *= gain_a;
        light.b(k, i) *= gain_b;
      }
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::TapMismatch, "Different gains of the two taps")
