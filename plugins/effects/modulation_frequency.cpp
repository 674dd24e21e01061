// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Frequency error of the oscillator: the distance is computed with the nominal frequency.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// Psi *= 1 + error, with the unwrapped phase.
struct ModulationFrequency final : Effect {
  static constexpr EffectInfo info{
      .touches = "distance",
      .confused_with = "rail_scale amplitude_walk",
      .experiment = "a frequency counter; an interferometer or laser tracker as a standard of length"};
  Param<double> error{this,
                      "error",
                      {.default_value = "0",
                       .min = -0.1,
                       .max = 0.1,
                       .text = "of the frequency, relative",
                       .off = 0,
                       .typical = 300e-6}};

  void apply(PhaseLevel& light) const {
    if (*error == 0) return;
    const double scale = *error * light.radians_per_metre();
    for (std::size_t i = 0; i < light.points(); ++i) light.phase_offset(i) += scale * light.distance(i);
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::ModulationFrequency, "Error of the modulation frequency")
