// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Nonlinearity of the taps' AD converter.
#include <tofgraph/effect.hpp>

namespace tofgraph {

/// A' = A - k2 A^2 / full_scale - k3 A^3 / full_scale^2, the same for B.
struct AdcNonlinearity final : Effect {
  static constexpr EffectInfo info{.touches = "amplitude intensity distance",
                                   .confused_with = "amplitude_walk wiggling",
                                   .experiment =
                                       "a series of integration times on a bright near target: the error as a function "
                                       "of the amplitude at one phase"};
  Param<double> quadratic{
      this,
      "quadratic",
      {.default_value = "0", .min = -0.5, .max = 0.5, .text = "k2 at full scale", .off = 0, .typical = 0.03}};
  Param<double> cubic{
      this,
      "cubic",
      {.default_value = "0", .min = -0.5, .max = 0.5, .text = "k3 at full scale", .off = 0, .typical = 0.02}};
  Param<double> full_scale{
      this, "full_scale", {.unit = "counts", .min = 1, .max = 1e9, .text = "default: the profile's full_well"}};

  void prepare(Setup& setup) {
    full_scale_ = full_scale.given() ? *full_scale : setup.camera().full_well;
    if (!(full_scale_ > 0))
      throw ConfigError("full_scale", "the profile has no full_well: give it, e.g. full_scale: 30000 counts");
  }

  void apply(ReadoutLevel& light) const {
    if (*quadratic == 0 && *cubic == 0) return;
    for (double& tap : light.all()) {
      const double share = tap / full_scale_;
      tap -= tap * share * (*quadratic + *cubic * share);
    }
  }

 private:
  double full_scale_ = 0;  // counts
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::AdcNonlinearity, "Nonlinear converter of the taps")
