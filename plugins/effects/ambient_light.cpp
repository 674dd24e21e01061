// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Unmodulated light that fills the taps.
#include <tofgraph/effect.hpp>

#include <algorithm>

namespace tofgraph {

/// A, B += rate t_int / 2 if `ambient` is not dark and the lens is open; above `suppression` the common part of a
/// pixel's taps is subtracted from both. The shot noise is that of all light, including the subtracted part.
struct AmbientLight final : Effect {
  static constexpr EffectInfo info{
      .touches = "intensity variance null1",
      .confused_with = "pixel_response",
      .experiment = "light on versus light off; the intensity as a function of the integration time",
      .scope = TOFGRAPH_SCOPE_SETUP};
  Param<double> rate{this,
                     "rate",
                     {.unit = "counts/s",
                      .default_value = "0 counts/s",
                      .min = 0,
                      .max = 1e12,
                      .text = "sum over both taps",
                      .off = 0,
                      .typical = 1e5}};
  Param<std::string> label{this, "label", {.text = "the ambient that the rate is for; default: every one but dark"}};
  Param<double> suppression{this,
                            "suppression",
                            {.unit = "counts",
                             .default_value = "none",
                             .min = 0,
                             .max = 1e9,
                             .choices = "none",
                             .text = "the mean of a pixel's taps above which the excess is removed from both"}};

  void apply(TapsLevel& light) const {
    const std::string_view ambient = light.condition().ambient;
    const bool capped = (light.condition().flags & TOFGRAPH_CONDITION_LENS_CAPPED) != 0;
    const bool lit = !capped && (label->empty() ? ambient != "dark" : ambient == *label);
    if (!lit || *rate == 0) return;
    const double added = *rate * light.condition().integration_time / 2;
    for (double& tap : light.all()) tap += added;
    if (suppression.keyword() == "none") return;
    for (std::size_t k = 0; k < light.exposures(); ++k) {
      for (std::size_t i = 0; i < light.points(); ++i) {
        light.remove(k, i, std::max(0.0, (light.a(k, i) + light.b(k, i)) / 2 - *suppression));
      }
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::AmbientLight, "Light that is not modulated")
