// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Clipping of the taps at their full well.
#include <tofgraph/effect.hpp>

#include <algorithm>

namespace tofgraph {

/// A, B <= full_well.
struct Saturation final : Effect {
  static constexpr EffectInfo info{.touches = "distance amplitude intensity null1 null2 variance",
                                   .confused_with = "adc_nonlinearity",
                                   .experiment = "a series of integration times on a bright near target"};
  Param<double> full_well{
      this,
      "full_well",
      {.unit = "counts", .default_value = "none", .min = 1, .max = 1e9, .choices = "none", .text = "of a tap"}};

  void apply(ReadoutLevel& light) const {
    if (full_well.keyword() == "none") return;
    for (double& tap : light.all()) tap = std::min(tap, *full_well);
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::Saturation, "Taps are clipped at their full well")
