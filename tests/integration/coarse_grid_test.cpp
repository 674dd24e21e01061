// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Rooms: diagnosis simulation
// Campaigns of many conditions have fewer superpixels.
#include "diagnosis/diagnose.hpp"
#include "tests/small_campaign.hpp"

#include <cmath>

namespace tofgraph::diagnosis {
namespace {

TEST(SuperpixelGrid, FallsWithTheConditions) {
  EXPECT_EQ(superpixel_grid(1000), 12U) << "as before";
  EXPECT_EQ(superpixel_grid(1001), 10U);
  EXPECT_EQ(superpixel_grid(20'000), 4U);
  for (std::size_t conditions = 1, before = grid; conditions < 40'000; conditions += 7) {
    const std::size_t side = superpixel_grid(conditions);
    EXPECT_LE(side, before);
    EXPECT_GE(side, 4U);
    EXPECT_TRUE(side == 4 || conditions * side * side <= settings.max_superpixels) << conditions;
    before = side;
  }
  EXPECT_EQ(superpixel_grid(1'000'000), 4U);
  EXPECT_EQ(superpixel_grid(12, 12 * 36), 6U);
  EXPECT_EQ(superpixel_grid(12, 12 * 36 - 1), 5U);
}

class CoarseGrid : public tests::SmallCampaign {
 protected:
  static constexpr std::size_t coarse = conditions * 16;  // 4 x 4 superpixels per condition

  static void SetUpTestSuite() { simulate(3, "taps"); }
  static Measurements measured(std::size_t max_superpixels) {
    config::Diagnostics diagnostics;
    const io::Campaign campaign = io::read_campaign(home() / "c/campaign.yaml", diagnostics);
    EXPECT_TRUE(diagnostics.ok()) << diagnostics.text();
    IngestOptions options;
    options.max_superpixels = max_superpixels;
    return measure(campaign, options);
  }
};

TEST_F(CoarseGrid, HasTheMeansOfFinerSuperpixels) {
  const Measurements fine = measured(settings.max_superpixels), few = measured(coarse);
  ASSERT_EQ(fine.design->side(), 12U);
  ASSERT_EQ(few.design->side(), 4U);
  for (std::size_t i = 0; i < conditions; ++i) {
    for (std::size_t s = 0; s < 16; ++s) {
      double sum = 0;
      for (std::size_t part = 0; part < 9; ++part) {
        const std::size_t at = (3 * (s / 4) + part / 3) * 12 + 3 * (s % 4) + part % 3;
        ASSERT_TRUE(std::isfinite(fine.observations[i].variance[distance * 144 + at]));
        sum += fine.observations[i].value[distance * 144 + at] / 9;
      }
      // Superpixels of 17 x 17 px have equal weights except for the light, which differs by a few percent.
      const double sd = std::sqrt(few.observations[i].variance[distance * 16 + s]);
      EXPECT_NEAR(few.observations[i].value[distance * 16 + s], sum, sd);
    }
  }
}

}  // namespace
}  // namespace tofgraph::diagnosis
