// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/effect.hpp>

/// A piece of the simulator's physics: the level that apply() takes says where on the way of the light it acts.
struct MyPlugin final : tofgraph::Effect {
  static constexpr tofgraph::EffectInfo info{.touches = "distance", .confused_with = "zero_offset"};
  Param<double> size{this,
                     "size",
                     {.unit = "m",
                      .default_value = "0 mm",
                      .min = -1,
                      .max = 1,
                      .text = "added to the distance",
                      .off = 0,           // with this value nothing changes
                      .typical = 0.01}};  // the size that a search tries first, m

  void apply(tofgraph::PhaseLevel& light) const {
    for (std::size_t i = 0; i < light.points(); ++i) light.phase_offset(i) += light.radians_per_metre() * *size;
  }
};
TOFGRAPH_EFFECT(MyPlugin, "The same error of the distance everywhere")
