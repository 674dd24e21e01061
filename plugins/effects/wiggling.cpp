// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Odd harmonics of light and demodulation, which are aliased into the phase because there are only a few samples.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// c_k += a m_h cos(h (Psi + theta_k) + psi_h), h = 3, 5, 7, with m_h = amplitude_h / K, K = c / (4 pi f).
/// Phase error with four steps of 90 degrees: -m3 sin(4 Psi + psi3) + m5 sin(4 Psi + psi5), and order 7 with 8 Psi.
struct Wiggling final : Effect {
  static constexpr EffectInfo info{
      .touches = "distance amplitude variance",
      .confused_with = "adc_nonlinearity",
      .experiment =
          "a rail span of more than 1.9 m, or an electronic delay; series of reflectivity and integration time"};
  static constexpr ParamSpec size(const char* text, double typical, bool nested = true) {
    return {.unit = "m",
            .default_value = "0 mm",
            .min = -0.5,
            .max = 0.5,
            .text = text,
            .off = 0,
            .typical = typical,
            .nested = nested};
  }
  static constexpr ParamSpec angle(const char* text, bool nested = true) {
    return {.unit = "rad",
            .default_value = "0 rad",
            .min = -M_PI,
            .max = M_PI,
            .text = text,
            .typical = 1,
            .nested = nested};
  }
  Param<double> amplitude{this, "amplitude", size("of the error due to the third harmonic, as a length", 5e-3, false)};
  Param<double> phase{this, "phase", angle("psi3", false)};
  Param<double> amplitude5{this, "amplitude5", size("the same for the fifth harmonic", 2e-3)};
  Param<double> phase5{this, "phase5", angle("psi5")};
  Param<double> amplitude7{this, "amplitude7", size("the same for the seventh harmonic", 1e-3)};
  Param<double> phase7{this, "phase7", angle("psi7")};

  void apply(SamplesLevel& light) const {
    add(light, 3, *amplitude, *phase);
    add(light, 5, *amplitude5, *phase5);
    add(light, 7, *amplitude7, *phase7);
  }

 private:
  static void add(const SamplesLevel& light, int order, double length, double angle) {
    if (length == 0) return;
    for (std::size_t k = 0; k < light.exposures(); ++k) {
      const std::complex<double> harmonic = std::polar(length * light.radians_per_metre(k), angle);
      const std::complex<double> turned = harmonic * std::polar(1.0, order * light.step(k));
      for (std::size_t i = 0; i < light.points(); ++i) {
        const std::complex<double> p = light.phasor(k, i);
        const double square = std::norm(p);
        if (!(square > 0)) continue;
        const std::complex<double> twice = p * p / square;  // of unit length, at twice the phase
        std::complex<double> harmonic_of_p = p;
        for (int h = 1; h < order; h += 2) harmonic_of_p *= twice;
        light.extra(k, i) += (harmonic_of_p * turned).real();
      }
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::Wiggling, "Odd harmonics of light and demodulation")
