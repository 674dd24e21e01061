// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The lens transmits less light to the corners.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// All light through the lens *= cos^n(theta_cam), in addition to the light model.
struct Vignetting final : Effect {
  static constexpr EffectInfo info{
      .touches = "amplitude intensity",
      .confused_with = "pixel_response beam_profile",
      .experiment = "an integrating sphere or a passive image; otherwise only its smooth shape"};
  Param<double> exponent{
      this, "exponent", {.default_value = "0", .min = -50, .max = 200, .text = "n", .off = 0, .typical = 4}};

  void apply(PhasorLevel& light) const {
    if (*exponent == 0) return;
    for (std::size_t i = 0; i < light.points(); ++i) {
      const double factor = std::pow(light.state.ray[3 * i + 2], *exponent);
      for (std::size_t s = 0; s < light.size(); ++s) {
        if (!light[s].from_inside() && light[s].strength[i] != 0) light[s].scale(i, factor);
      }
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::Vignetting, "Less light in the corners")
