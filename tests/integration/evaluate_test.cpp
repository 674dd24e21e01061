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
  using Images = std::vector<SmallCapture::Image>;

  /// Evaluates a campaign of one condition with frames of this channel, a board at 1 m.
  Outcome evaluate(const std::string& channel, const Images& frames, double frequency = 20e6) {
    const SmallCapture::Image amplitude(small_pixels, 100);
    const std::size_t count = frames.size();
    SmallCapture capture{.channels = {{channel, frames}, {"amplitude", std::vector(count, amplitude)}},
                         .flags = std::vector(count, flags),
                         .frequency = frequency};
    capture.write(folder_.path() / (channel + ".h5"));
    write_text(folder_.path() / "tiny.yaml", small_profile);
    write_text(folder_.path() / "c.yaml", "campaign: 1\ncamera: ./tiny.yaml\nconditions:\n  - {id: a, capture: " +
                                              channel + ".h5, board: {distance: 1 m}}\n");
    return shell("$TOFGRAPH evaluate c.yaml -o out --force", folder_.path());
  }
  /// Its result.
  nlohmann::json condition_of(const std::string& channel, const Images& frames) {
    const Outcome outcome = evaluate(channel, frames);
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
  const nlohmann::json condition = condition_of("depth", Images(4, depth));
  EXPECT_EQ(condition["channel"], "depth");
  EXPECT_NEAR(condition["bias"], 2e-3, 1e-6);
  EXPECT_NEAR(condition["rms"], 2e-3, 1e-6);
  EXPECT_NEAR(condition["missing"], 2.0 / small_pixels, 1e-9);
}

TEST_F(Evaluate, PointsAtTheOriginAreNoErrors) {
  SmallCapture::Image points(3 * small_pixels, measured - 2e-3F);  // the lens centre is 2 mm in front of the sensor
  std::fill_n(&points[3 * 7], 3, 0.0F);
  const nlohmann::json condition = condition_of("points", Images(4, points));
  EXPECT_EQ(condition["channel"], "points");
  EXPECT_NEAR(condition["bias"], 2e-3, 1e-6);
  EXPECT_NEAR(condition["missing"], 1.0 / small_pixels, 1e-9);
}

TEST_F(Evaluate, PixelsWithASingleFrameHaveNoNoise) {
  SmallCapture::Image first(small_pixels, measured - 1e-3F), second(small_pixels, measured + 1e-3F);
  second[0] = 0;
  const nlohmann::json condition = condition_of("depth", {first, second});
  EXPECT_EQ(condition["missing"].get<double>(), 0);
  ASSERT_TRUE(condition["noise"].is_number()) << condition;
  EXPECT_NEAR(condition["noise"], std::sqrt(2) * 1e-3, 1e-6);
}

// Distances with a noise of 1 mm in the middle and of 10 mm in the outermost of the five rings.
TEST_F(Evaluate, TheNoiseOfRawDistancesIsThatOfTheirPixels) {
  SmallCapture::Image first(small_pixels), second(small_pixels);
  for (std::size_t i = 0; i < small_pixels; ++i) {
    const double radius =
        std::hypot(static_cast<double>(i % small_width) - 3.5, static_cast<double>(i / small_width) - 2.5);
    const float noise = radius > 0.8 * std::hypot(3.5, 2.5) ? 10e-3F : 1e-3F;
    first[i] = measured - noise / std::sqrt(2.0F);
    second[i] = measured + noise / std::sqrt(2.0F);
  }
  const nlohmann::json condition = condition_of("distance", {first, second});
  EXPECT_EQ(condition["channel"], "raw");
  EXPECT_NEAR(condition["by_radius"][0]["noise"], 1e-3, 0.02e-3);
  EXPECT_NEAR(condition["by_radius"][4]["noise"], 10e-3, 0.2e-3);
}

TEST_F(Evaluate, RawDistancesOfAnotherFrequencyAreRefused) {
  const Outcome outcome = evaluate("distance", Images(2, SmallCapture::Image(small_pixels, measured)), 30e6);
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("was recorded at 30 MHz, the camera 'tiny' works at 20 MHz"), std::string::npos)
      << outcome.err;
}

}  // namespace
