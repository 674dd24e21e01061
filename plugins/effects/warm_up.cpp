// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Drift of the distance and droop of the light while the camera warms up.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// D += (drift (1 - e^(-t/tau)) + slow_drift (1 - e^(-t/slow_tau))) (t_int / reference_time)^exponent,
/// light *= 1 - droop (1 - e^(-t/tau)), t since power-on; if t is unknown, the camera is warm.
struct WarmUp final : Effect {
  static constexpr EffectInfo info{
      .touches = "distance amplitude intensity",
      .confused_with = "integration_time_offset rail_offset zero_offset",
      .experiment =
          "one board again and again from a minute after power-on; a random order of the conditions; temperatures"};
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
  Param<double> slow_drift{this,
                           "slow_drift",
                           {.unit = "m",
                            .default_value = "0 mm",
                            .min = -1,
                            .max = 1,
                            .text = "of a second, slower process",
                            .off = 0,
                            .typical = 5e-3,
                            .nested = true}};
  Param<double> slow_time_constant{this,
                                   "slow_time_constant",
                                   {.unit = "s",
                                    .default_value = "4 h",
                                    .min = 1,
                                    .max = 360000,
                                    .text = "of the slow drift",
                                    .typical = 14400,
                                    .nested = true}};
  Param<double> exponent{this,
                         "exponent",
                         {.default_value = "0",
                          .min = -4,
                          .max = 4,
                          .text = "of the integration time, which heats",
                          .off = 0,
                          .typical = 0.3,
                          .nested = true}};
  Param<double> reference_time{this,
                               "reference_time",
                               {.unit = "s",
                                .default_value = "1 ms",
                                .min = 1e-7,
                                .max = 10,
                                .text = "integration time of which the drifts are, not fitted"}};

  void apply(PhasorLevel& light) const {
    const double time = light.condition().time_since_power_on;
    const auto share = [time](double tau) { return std::isnan(time) ? 1 : -std::expm1(-time / tau); };
    const double warm = share(*time_constant);
    const double length = (*drift * warm + *slow_drift * share(*slow_time_constant)) * heating(light.condition());
    const double turn = length * light.radians_per_metre(), factor = 1 - *droop * warm;
    for (std::size_t i = 0; i < light.points(); ++i) light.phase_offset(i) += turn;
    for (std::size_t s = 0; s < light.size(); ++s) {
      if (light[s].from_inside()) continue;
      for (std::size_t i = 0; i < light.points(); ++i) light[s].scale(i, factor);
    }
  }

 private:
  double heating(const tofgraph_condition& condition) const {
    return *exponent == 0 ? 1 : std::pow(condition.integration_time / *reference_time, *exponent);
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::WarmUp, "Drift and droop while the camera warms up")
