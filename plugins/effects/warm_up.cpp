// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Drift of the distance and droop of the light while the camera warms up.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// D += drift (1 - e^(-t/tau)), light *= 1 - droop (1 - e^(-t/tau)), t since power-on; where t is not known, the camera
/// is warm.
struct WarmUp final : Effect {
  static constexpr EffectInfo info{
      .touches = "distance amplitude intensity",
      .confused_with = "integration_time_offset rail_offset",
      .experiment = "a random order of the conditions; coming back to a reference condition; temperatures"};
  Param<double> drift{this,
                      "drift",
                      {.unit = "m",
                       .default_value = "0 mm",
                       .min = -1,
                       .max = 1,
                       .text = "of the distance until it is warm",
                       .off = 0,
                       .typical = 10e-3}};
  Param<double> time_constant{
      this,
      "time_constant",
      {.unit = "s", .default_value = "720 s", .min = 1, .max = 36000, .text = "tau", .typical = 720}};
  Param<double> droop{this,
                      "droop",
                      {.default_value = "0",
                       .min = -0.9,
                       .max = 0.9,
                       .text = "of the light until it is warm",
                       .off = 0,
                       .typical = 0.03}};

  void apply(PhasorLevel& light) const {
    const double time = light.condition().time_since_power_on;
    const double warm = std::isnan(time) ? 1 : -std::expm1(-time / *time_constant);
    const double turn = *drift * warm * light.radians_per_metre(), factor = 1 - *droop * warm;
    for (std::size_t i = 0; i < light.points(); ++i) light.phase_offset(i) += turn;
    for (std::size_t s = 0; s < light.size(); ++s) {
      if (light[s].from_inside()) continue;
      for (std::size_t i = 0; i < light.points(); ++i) light[s].scale(i, factor);
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::WarmUp, "Drift and droop while the camera warms up")
