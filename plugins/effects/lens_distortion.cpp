// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The lens bends rays otherwise than the profile says.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// k1 k2 p1 p2 k3 of OpenCV's model, added to the profile's.
struct LensDistortion final : Effect {
  static constexpr EffectInfo info{.touches = "distance amplitude",
                                   .confused_with = "stray_light fixed_pattern",
                                   .experiment = "corners of a chessboard; a tilted board"};
  static constexpr ParamSpec length(const char* text, double typical = ParamSpec::none) {
    return {.default_value = "0",
            .min = -2,
            .max = 2,
            .text = text,
            .off = typical == typical ? 0 : ParamSpec::none,
            .typical = typical};
  }
  Param<double> k1{this, "k1", length("added to the profile's", -0.1)};
  Param<double> k2{this, "k2", length("added to the profile's")};
  Param<double> p1{this, "p1", length("added to the profile's")};
  Param<double> p2{this, "p2", length("added to the profile's")};
  Param<double> k3{this, "k3", length("added to the profile's")};

  void apply(GeometryLevel& light) const {
    const double added[] = {*k1, *k2, *p1, *p2, *k3};
    for (std::size_t i = 0; i < 5; ++i) light.state.distortion[i] += added[i];
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::LensDistortion, "A different distortion of the lens")
