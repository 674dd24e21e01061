// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Corrections that flatten planes, and those that only seem to.
#include "inspection/flatness.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tofgraph::inspection {
namespace {

const physics::Vector3 none{std::nan(""), std::nan(""), std::nan("")};

/// Four blocks at depths that differ by `change` from 1 m; the first has no ray if `lost` is true.
Flatness flatness(double rms, double change, bool lost = false) {
  Flatness made{.rms = rms, .count = 4};
  for (int i = 0; i < 4; ++i) made.points.push_back(lost && i == 0 ? none : physics::Vector3{0.1 * i, 0, 1 + change});
  return made;
}

TEST(Flatness, ACorrectionMovesBlocksByTheDeviationThatItRemoves) {
  EXPECT_TRUE(moves_enough(flatness(0.02, 0), flatness(0.001, 0.02)));
  EXPECT_FALSE(moves_enough(flatness(0.02, 0), flatness(0.001, 0.002))) << "an ill-conditioned plane";
}

/// A corner of the image may be outside the lens model under both assumptions.
TEST(Flatness, BlocksThatHaveNoRayEitherWayDecideNothing) {
  EXPECT_TRUE(moves_enough(flatness(0.02, 0, true), flatness(0.001, 0.03, true)));
  EXPECT_FALSE(moves_enough(flatness(0.02, 0, true), flatness(0.001, 0.002, true)));
  EXPECT_TRUE(moves_enough(flatness(0.02, 0, true), flatness(0.001, 0.002))) << "a ray is gained";
  EXPECT_TRUE(moves_enough(flatness(0.02, 0), flatness(0.001, 0.002, true))) << "a ray is lost";
}

}  // namespace
}  // namespace tofgraph::inspection
