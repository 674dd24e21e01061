// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Light or current that reaches the pixels inside the camera, equal for all of them or random.
#include "plugins/pixel_pattern.hpp"

namespace tofgraph {

/// P += X t_int, X = real + j imaginary + spread (z1 + j z2), z drawn for each pixel; |X| t_int is added to the
/// intensity.
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

  Param<double> spread{this,
                       "spread",
                       {.unit = "counts/s",
                        .default_value = "0 counts/s",
                        .min = 0,
                        .max = 1e8,
                        .text = "standard deviation of each part from pixel to pixel: drawn, normal and independent"}};
  Param<std::int64_t> seed{this, "seed", {.default_value = "2", .min = 0, .text = "of what is drawn"}};

  void apply(PhasorLevel& light) const {
    if (*real == 0 && *imaginary == 0 && *spread == 0) return;
    const double time = light.condition().integration_time;
    const std::complex<double> common = std::complex<double>(*real, *imaginary) * time;
    const SourceLight inside = light[light.size() - 1];
    for (std::size_t i = 0; i < light.points(); ++i) {
      std::complex<double> added = common;
      if (*spread > 0) {
        const auto [across, along] = drawn_pattern(light, i, *seed);
        added += *spread * time * std::complex<double>(across, along);
      }
      inside.phasor[i] += added;
      inside.strength[i] += std::abs(added);
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::Crosstalk, "Modulated light or current from inside the camera")
