// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The positions of the sources differ from the profile.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// S = ((|x| + separation) sign(x) + shift, y, z + depth).
struct SourcePosition final : Effect {
  static constexpr EffectInfo info{
      .touches = "distance amplitude intensity",
      .confused_with = "rail_offset source_amplitude",
      .experiment = "distances below 0.7 m; frames with one source at a time; the amplitude as a function of 1/Z^2"};
  static constexpr ParamSpec length(const char* text) {
    return {.unit = "m", .default_value = "0 mm", .min = -0.1, .max = 0.1, .text = text, .off = 0, .typical = 4e-3};
  }
  Param<double> separation{this, "separation", length("each source farther outwards along x")};
  Param<double> shift{this, "shift", length("all sources along x")};
  Param<double> depth{this, "depth", length("all sources along z")};

  void apply(GeometryLevel& light) const {
    for (tofgraph_source_light& source : light.sources()) {
      double& x = source.position[0];
      const double outwards = x < 0 ? -1 : x > 0 ? 1 : 0;
      x += outwards * *separation + *shift;
      source.position[2] += *depth;
    }
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::SourcePosition, "Sources at positions other than the profile says")
