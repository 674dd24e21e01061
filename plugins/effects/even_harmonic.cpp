// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Second harmonic of light and demodulation: four samples show it only in N2.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// c_k += a m2 cos(2 (Psi + theta_k)). With four steps of 90 degrees N2 = a m2 cos 2 Psi without a distance error; with
/// three steps of 120 degrees the phase error is -m2 sin(3 Psi).
struct EvenHarmonic final : Effect {
  static constexpr EffectInfo info{.touches = "null2", .confused_with = "phase_gain", .experiment = "the raw samples"};
  Param<double> ratio{
      this,
      "ratio",
      {.default_value = "0", .min = -0.5, .max = 0.5, .text = "m2, of the amplitude", .off = 0, .typical = 0.02}};

  void apply(SamplesLevel& light) const {
    if (*ratio == 0) return;
    for (std::size_t k = 0; k < light.exposures(); ++k) {
      const std::complex<double> turned = std::polar(*ratio, 2 * light.step(k));
      for (std::size_t i = 0; i < light.points(); ++i) {
        const std::complex<double> p = light.phasor(k, i);
        const double amplitude = std::abs(p);
        if (amplitude > 0) light.extra(k, i) += (p * p * turned).real() / amplitude;
      }
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::EvenHarmonic, "Second harmonic of light and demodulation")
