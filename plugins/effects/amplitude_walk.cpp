// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The phase depends on the amount of light, whatever its cause.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// Psi += a1 ln(a/a0) + a2 a0/a, with the amplitude a of all light; no change where a is 0.
struct AmplitudeWalk final : Effect {
  static constexpr EffectInfo info{
      .touches = "distance",
      .confused_with = "modulation_frequency rail_scale crosstalk integration_time_offset",
      .experiment = "three reflectivities or more at one distance; a series of integration times at one distance"};
  Param<double> logarithmic{this,
                            "logarithmic",
                            {.unit = "rad",
                             .default_value = "0 rad",
                             .min = -1,
                             .max = 1,
                             .text = "a1, for a factor e of amplitude",
                             .off = 0,
                             .typical = 8e-3}};
  Param<double> inverse{this,
                        "inverse",
                        {.unit = "rad",
                         .default_value = "0 rad",
                         .min = -1,
                         .max = 1,
                         .text = "a2, at the reference amplitude",
                         .off = 0,
                         .typical = 3e-3}};
  Param<double> reference_amplitude{
      this,
      "reference_amplitude",
      {.unit = "counts", .default_value = "1000 counts", .min = 1e-3, .max = 1e6, .text = "a0, not fitted"}};

  void apply(PhaseLevel& light) const {
    if (*logarithmic == 0 && *inverse == 0) return;
    for (std::size_t i = 0; i < light.points(); ++i) {
      const double ratio = light.amplitude(i) / *reference_amplitude;
      if (ratio > 0) light.phase_offset(i) += *logarithmic * std::log(ratio) + *inverse / ratio;
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::AmplitudeWalk, "Phase error that depends on the amount of light")
