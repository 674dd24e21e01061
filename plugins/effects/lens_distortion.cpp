// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The distortion of the lens differs from the profile.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// Adds k1 k2 p1 p2 k3 of OpenCV's model to the profile's. Fisheyes and tables of rays have no such coefficients.
struct LensDistortion final : Effect {
  static constexpr EffectInfo info{.touches = "distance amplitude",
                                   .confused_with = "stray_light fixed_pattern",
                                   .experiment = "corners of a chessboard; a tilted board"};
  static constexpr ParamSpec added(double typical, bool nested = true) {
    return {.default_value = "0",
            .min = -2,
            .max = 2,
            .text = "coefficient that is added to the profile's",
            .off = 0,
            .typical = typical,
            .nested = nested};
  }
  Param<double> k1{this, "k1", added(-0.1, false)};
  Param<double> k2{this, "k2", added(0.1)};
  Param<double> p1{this, "p1", added(2e-3)};
  Param<double> p2{this, "p2", added(2e-3)};
  Param<double> k3{this, "k3", added(0.1)};

  void prepare(Setup& setup) const {
    const std::uint32_t lens = setup.camera().lens_model;
    if (lens == TOFGRAPH_LENS_OPENCV) return;
    for (const Param<double>* coefficient : {&k1, &k2, &p1, &p2, &k3}) {
      if (**coefficient == 0) continue;
      throw ConfigError(coefficient->parameter().name,
                        std::string("is a coefficient of OpenCV's lens model, but the lens of the profile is a ") +
                            (lens == TOFGRAPH_LENS_FISHEYE ? "fisheye" : "table of rays"));
    }
  }

  void apply(GeometryLevel& light) const {
    const double change[] = {*k1, *k2, *p1, *p2, *k3};
    for (std::size_t i = 0; i < 5; ++i) light.state.distortion[i] += change[i];
  }
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::LensDistortion, "A different distortion of the lens")
