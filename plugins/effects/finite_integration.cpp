// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Light and reference are on for a finite time.
#include <tofgraph/effect.hpp>
#include <tofgraph/physics/correlation.hpp>

namespace tofgraph {

/// The correlation of windows of length T falls with the lag as a triangle, equations (5.53) to (5.57), with a ripple
/// of at most 1 / (w T). Sample k is taken at the lag 2 D / c + theta_k / w. Sources whose windows are shifted relative
/// to each other (5.2) interfere while both are on, T minus the shift. The collected light and therefore the noise stay
/// the same, so the signal-to-noise ratio (5.43) falls with the correlation. Both parameters are settings of a camera's
/// driver; a search for missing effects does not vary them.
struct FiniteIntegration final : Effect {
  static constexpr EffectInfo info{.touches = "distance amplitude null1 null2",
                                   .confused_with = "phase_gain",
                                   .experiment = "another on-time; the amplitude as a function of the distance"};
  Param<double> window{this,
                       "window",
                       {.unit = "s",
                        .default_value = "0 s",
                        .min = 0,
                        .max = 1,
                        .text = "on-time of light and reference, T of (5.3); 0 s: unlimited"}};
  Param<double> on_time_shift{this,
                              "on_time_shift",
                              {.unit = "s",
                               .default_value = "0 s",
                               .min = 0,
                               .max = 1,
                               .text = "between the windows of the sources, tau of (5.2)"}};

  void prepare(Setup&) const {
    if (*on_time_shift != 0 && !(*on_time_shift < *window))
      throw ConfigError("on_time_shift", "must be shorter than the window, e.g. window: 10 us, on_time_shift: 100 ns");
  }

  void apply(SamplesLevel& light) const {
    if (*window == 0) return;
    const double both = *window - *on_time_shift;
    for (std::size_t k = 0; k < light.exposures(); ++k) {
      const double frequency = light.exposure(k).frequency, angular = physics::two_pi * frequency;
      for (std::size_t i = 0; i < light.points(); ++i) {
        const double delay = 2 * light.state.distance[i] / physics::speed_of_light;
        const auto [envelope, ripple] = physics::windowed_correlation(delay + light.step(k) / angular, both, frequency);
        std::complex<double>& p = light.phasor(k, i);
        light.extra(k, i) += both / *window * ripple * (p * std::polar(1.0, -angular * delay)).real();
        p *= both / *window * envelope;
      }
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::FiniteIntegration, "Light and reference that are on for a finite time")
