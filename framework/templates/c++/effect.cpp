// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/effect.hpp>

/// Part of the simulator's physics: the level in apply()'s argument determines where in the light path it acts.
struct MyPlugin final : tofgraph::Effect {
  static constexpr tofgraph::EffectInfo info{.touches = "distance", .confused_with = "zero_offset"};
  Param<double> size{this,
                     "size",
                     {.unit = "m",
                      .default_value = "0 mm",
                      .min = -1,
                      .max = 1,
                      .text = "added to the distance",
                      .off = 0,           // value without effect
                      .typical = 0.01}};  // value that a search tries first, m

  void apply(tofgraph::PhaseLevel& light) const {
    for (std::size_t i = 0; i < light.points(); ++i) light.phase_offset(i) += light.radians_per_metre() * *size;
  }
};
TOFGRAPH_EFFECT(MyPlugin, "The same error of the distance everywhere")
