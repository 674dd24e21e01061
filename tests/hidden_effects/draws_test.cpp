// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Draws for a typical amplitude: the main parameters of a seed do not depend on other draws, further parameters are
// within the ranges of the catalogue.
#include "tests/hidden_effects/effects.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tofgraph::hidden {
namespace {

Effects drawn(const std::string& name, double size, std::uint64_t seed, Drawn kind) {
  Effects effects;
  effects.add_typical(name, size, seed, kind);
  return effects;
}

TEST(Draws, MainParametersAreThoseOfThePlainDraw) {
  for (const Effect& effect : catalogue())
    for (const std::uint64_t seed : {3U, 31005U}) {
      const Effects plain = drawn(effect.name, 1, seed, Drawn::plain), all = drawn(effect.name, 1, seed, Drawn::all);
      for (const Parameter& parameter : effect.parameters) {
        const double off = plain.value(effect.name, parameter.name), on = all.value(effect.name, parameter.name);
        if (!parameter.further)
          EXPECT_EQ(off, on) << effect.name << " " << parameter.name;
        else
          EXPECT_TRUE(off == parameter.off && on != parameter.off) << effect.name << " " << parameter.name;
      }
    }
}

/// Drawn before further parameters were added.
TEST(Draws, AnOldSeedGivesItsOldValues) {
  const Effects wiggling = drawn("wiggling", 1, 5, Drawn::all), distortion = drawn("lens_distortion", 1, 5, Drawn::all);
  EXPECT_EQ(wiggling.value("wiggling", "amplitude"), 5e-3);
  EXPECT_DOUBLE_EQ(wiggling.value("wiggling", "phase"), 2.1952328141187385);
  EXPECT_EQ(distortion.value("lens_distortion", "k1"), -0.1);
}

TEST(Draws, FurtherParametersKeepToTheirSizes) {
  double largest = 0, sum = 0;
  constexpr std::uint64_t seeds = 400;
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    const double toe = drawn("beam_profile", 1, seed, Drawn::all).value("beam_profile", "toe");
    largest = std::max(largest, std::abs(toe));
    sum += toe;
    const Effects half = drawn("wiggling", 0.5, seed, Drawn::all);
    EXPECT_DOUBLE_EQ(half.value("wiggling", "amplitude5"), 0.35 * half.value("wiggling", "amplitude"));
    EXPECT_DOUBLE_EQ(half.value("wiggling", "amplitude7"), 0.2 * half.value("wiggling", "amplitude"));
    EXPECT_NE(half.value("wiggling", "phase5"), half.value("wiggling", "phase7"));
    const Effects lens = drawn("lens_distortion", 1, seed, Drawn::all);
    EXPECT_LT(std::abs(lens.value("lens_distortion", "k2")), 0.5 * std::abs(lens.value("lens_distortion", "k1")));
    EXPECT_LT(std::abs(lens.value("lens_distortion", "k3")), 0.5 * std::abs(lens.value("lens_distortion", "k1")));
  }
  EXPECT_LE(largest, 40e-3);
  EXPECT_GT(largest, 38e-3);                                                // of 400 uniform draws
  EXPECT_NEAR(sum / seeds, 0, 3 * 40e-3 / std::sqrt(3.0 * double{seeds}));  // three standard deviations of the mean
}

}  // namespace
}  // namespace tofgraph::hidden
