// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Clouds and depths, compared with known planes, with pixels that hold no measurement.
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/small_capture.hpp"

#include <fstream>

using namespace tofgraph::tests;

namespace {

class Evaluate : public testing::Test {
 protected:
  /// The only condition of a campaign with this channel, a board at 1 m.
  nlohmann::json condition_of(const std::string& channel, const SmallCapture::Image& image) {
    const SmallCapture::Image amplitude(small_pixels, 100);
    SmallCapture capture{.channels = {{channel, std::vector(4, image)}, {"amplitude", std::vector(4, amplitude)}},
                         .flags = std::vector(4, flags)};
    capture.write(folder_.path() / (channel + ".h5"));
    write_text(folder_.path() / "tiny.yaml", small_profile);
    write_text(folder_.path() / "c.yaml", "campaign: 1\ncamera: ./tiny.yaml\nconditions:\n  - {id: a, capture: " +
                                              channel + ".h5, board: {distance: 1 m}}\n");
    const Outcome outcome = shell("$TOFGRAPH evaluate c.yaml -o out --force", folder_.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    std::ifstream in(folder_.path() / "out/evaluation.json");
    return nlohmann::json::parse(in)["conditions"][0];
  }
  static constexpr float measured = 1.002F;  // m
  std::vector<std::uint16_t> flags = std::vector<std::uint16_t>(small_pixels, 0);

 private:
  TemporaryFolder folder_;
};

TEST_F(Evaluate, ZerosAndFlaggedPixelsAreNoErrors) {
  SmallCapture::Image depth(small_pixels, measured);
  depth[0] = 0;
  depth[5] = 3;
  flags[5] = 1;  // invalid
  const nlohmann::json condition = condition_of("depth", depth);
  EXPECT_EQ(condition["channel"], "depth");
  EXPECT_NEAR(condition["bias"], 2e-3, 1e-6);
  EXPECT_NEAR(condition["rms"], 2e-3, 1e-6);
  EXPECT_NEAR(condition["missing"], 2.0 / small_pixels, 1e-9);
}

TEST_F(Evaluate, PointsAtTheOriginAreNoErrors) {
  SmallCapture::Image points(3 * small_pixels, measured - 2e-3F);  // the lens centre is 2 mm in front of the sensor
  std::fill_n(&points[3 * 7], 3, 0.0F);
  const nlohmann::json condition = condition_of("points", points);
  EXPECT_EQ(condition["channel"], "points");
  EXPECT_NEAR(condition["bias"], 2e-3, 1e-6);
  EXPECT_NEAR(condition["missing"], 1.0 / small_pixels, 1e-9);
}

}  // namespace
