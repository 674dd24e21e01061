// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Light or current that gets into the pixels inside the camera, the same for all of them.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// P += X t_int; |X| t_int counts in the intensity.
struct Crosstalk final : Effect {
  static constexpr EffectInfo info{
      .touches = "distance amplitude intensity",
      .confused_with = "amplitude_walk static_reflection stray_light",
      .experiment = "a capped lens or a black target; a series of reflectivities over more than half of the range"};
  Param<double> real{this,
                     "real",
                     {.unit = "counts/s",
                      .default_value = "0 counts/s",
                      .min = -1e8,
                      .max = 1e8,
                      .text = "part in phase with the emitted light",
                      .off = 0,
                      .typical = 1500}};
  Param<double> imaginary{this,
                          "imaginary",
                          {.unit = "counts/s",
                           .default_value = "0 counts/s",
                           .min = -1e8,
                           .max = 1e8,
                           .text = "part a quarter turn later",
                           .off = 0,
                           .typical = 1500}};

  void apply(PhasorLevel& light) const {
    if (*real == 0 && *imaginary == 0) return;
    const std::complex<double> added = std::complex<double>(*real, *imaginary) * light.condition().integration_time;
    const double strength = std::abs(added);
    const SourceLight inside = light[light.size() - 1];
    for (std::size_t i = 0; i < light.points(); ++i) {
      inside.phasor[i] += added;
      inside.strength[i] += strength;
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::Crosstalk, "Modulated light or current from inside the camera")
