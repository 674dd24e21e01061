// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The simulated board through sampling, decoding and correction, compared with the published table and its own noise.
#include <gtest/gtest.h>
#include <tofgraph/harness.hpp>

#include "tests/unit/cameras.hpp"
#include "tests/unit/message_of.hpp"
#include "tests/unit/thesis_table.hpp"

#include <cmath>

using namespace tofgraph;

namespace {

constexpr std::size_t pixels = 204 * 204;
constexpr double c_light = 299792458.0;

std::vector<float> samples_of(const std::string& line, const std::string& profile, int frame = 0) {
  Harness source("simulator " + line);
  source.camera(profile);
  for (int i = 0; i <= frame; ++i) {
    if (!source.run()) throw std::runtime_error("no such frame");
  }
  return source.get<float>("phases");
}

/// The decoder with the camera's noise.
struct Decoder {
  explicit Decoder(const std::string& profile) : stage("four_phase_decoder") {
    stage.camera(profile);
    stage.metadata().modulation_frequency = 20e6;
  }
  const std::vector<float>& operator()(const std::vector<float>& phases) {
    stage.put<float>("phases", {4, 204, 204}, phases);
    stage.run();
    return distance = stage.get<float>("distance");
  }
  Harness stage;
  std::vector<float> distance;
};

TEST(Simulator, ReproducesThePublishedTableThroughSamplesAndDecoder) {
  const std::string profile = test::profile_of(test::camcube2().view);
  Decoder decode(profile);
  for (const auto& board : test::modelled_boards()) {
    const auto distance = decode(samples_of("noise=none distance=\"" + std::to_string(board.depth) + " m\"", profile));
    const auto seen = test::over_window(board.half_width, board.half_height, [&](std::size_t row, std::size_t column) {
      return distance[row * 204 + column];
    });
    // Beyond the unambiguous range the distances wrap around.
    const double wrapped = board.depth < 7.4 ? board.mean : board.mean - c_light / 40e6;
    EXPECT_NEAR(seen.mean, wrapped, 0.01e-3) << board.depth;
    EXPECT_NEAR(seen.deviation, board.deviation, 0.01e-3) << board.depth;
  }
}

TEST(Simulator, AmplitudeFallsAsTheTableOfAttenuation) {
  // At 500 mm, 1/D_t^2 normalised to its maximum spans 0.837 .. 1, 0.911 at the end of the middle row.
  const std::string profile = test::profile_of(test::camcube2().view);
  Decoder decode(profile);
  decode(samples_of("noise=none distance=\"500 mm\"", profile));
  const auto amplitude = decode.stage.get<float>("amplitude");
  const float greatest = *std::max_element(amplitude.begin(), amplitude.end());
  EXPECT_NEAR(*std::min_element(amplitude.begin(), amplitude.end()) / greatest, 0.837, 0.001);
  EXPECT_NEAR(amplitude[101 * 204] / greatest, 0.911, 0.001);
  // gain * reflectivity * integration time / D_t^2 with D_t = 2 D at the centre: two sources at 50 mm
  const double travelled = std::hypot(0.5, 0.05) + 0.5;
  EXPECT_NEAR(greatest, 7e6 * 0.85 * 1e-3 / (travelled * travelled), 1);
}

TEST(Simulator, NoiseIsThatOfTheProfile) {
  const std::string profile = test::profile_of(test::camcube2().view);
  const std::vector<float> clean = samples_of("noise=none distance=\"2 m\"", profile);
  const std::vector<float> noisy = samples_of("distance=\"2 m\" seed=9", profile);
  double squares = 0, sum = 0;
  for (std::size_t i = 0; i < clean.size(); ++i) {
    sum += noisy[i] - clean[i];
    squares += std::pow(noisy[i] - clean[i], 2);
  }
  const double n = static_cast<double>(clean.size());
  // At the centre a = 7e6 * 0.85 * 1e-3 / 4.01^2; the light of a tap is a, as the contrast is 0.5.
  const double amplitude = std::hypot(clean[101 * 204 + 101], clean[pixels + 101 * 204 + 101]);
  const double expected = 2 * (9 + 0.012 * amplitude);
  EXPECT_NEAR(squares / n, expected, 0.04 * expected) << "the light falls by some percent to the corners";
  EXPECT_NEAR(sum / n, 0, 5 * std::sqrt(expected / n));
}

TEST(Simulator, TheDecodersSigmaIsTheSpreadOverFrames) {
  const std::string profile = test::profile_of(test::camcube2().view);
  Harness source("simulator distance=\"3 m\" frames=0");
  source.camera(profile);
  Decoder decode(profile);
  std::vector<double> sum(pixels), squares(pixels);
  std::vector<float> sigma;
  constexpr int count = 40;
  for (int k = 0; k < count; ++k) {
    ASSERT_TRUE(source.run());
    const auto& distance = decode(source.get<float>("phases"));
    for (std::size_t i = 0; i < pixels; ++i) {
      sum[i] += distance[i];
      squares[i] += static_cast<double>(distance[i]) * distance[i];
    }
    sigma = decode.stage.get<float>("sigma");
  }
  double ratio = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const double variance = (squares[i] - sum[i] * sum[i] / count) / (count - 1);
    ratio += variance / (static_cast<double>(sigma[i]) * sigma[i]) / pixels;
  }
  EXPECT_NEAR(ratio, 1, 0.01);
}

TEST(Simulator, FramesRepeatForTheSameSeedOnly) {
  const std::string profile = test::profile_of(test::camcube2().view);
  const auto first = samples_of("frames=2 seed=4", profile), again = samples_of("frames=2 seed=4", profile);
  const auto second = samples_of("frames=2 seed=4", profile, 1), other = samples_of("frames=2 seed=5", profile);
  EXPECT_EQ(first, again);
  EXPECT_NE(first, second);
  EXPECT_NE(first, other);
}

TEST(Simulator, TellsItsSettings) {
  Harness source("simulator frames=3 integration_time=\"2 ms\" frame_rate=\"50 Hz\" noise=none");
  source.camera(test::profile_of(test::camcube2().view));
  ASSERT_TRUE(source.run());
  ASSERT_TRUE(source.run());
  EXPECT_EQ(source.extent("phases"), (std::vector<std::uint64_t>{4, 204, 204}));
  ASSERT_TRUE(source.run());
  EXPECT_FALSE(source.run());
}

TEST(Simulator, RefusesWhatItCannotKnow) {
  const auto prepared = [](const std::string& line, const test::Camera& camera) {
    Harness source("simulator " + line);
    source.camera(test::profile_of(camera.view));
    return message_of([&] { source.prepare(); });
  };
  test::Camera camera = test::camcube2();
  EXPECT_NE(prepared("distance=\"10 mm\"", camera).find("behind the lens"), std::string::npos);
  camera.view.shot_noise = std::nan("");
  EXPECT_NE(prepared("", camera).find("noise: none"), std::string::npos);
  EXPECT_EQ(prepared("noise=none", camera), "no error");
  camera.view.frame_rate = std::nan("");
  EXPECT_NE(prepared("noise=none", camera).find("frame_rate: 80 Hz"), std::string::npos);
  camera.view.gain = std::nan("");
  EXPECT_NE(prepared("noise=none", camera).find("has no gain"), std::string::npos);
  camera.view.focal_length = camera.view.pitch[0] = camera.view.pitch[1] = std::nan("");
  EXPECT_NE(prepared("noise=none", camera).find("no focal length in metres"), std::string::npos);
  Harness nobody("simulator");
  EXPECT_NE(message_of([&] { nobody.prepare(); }).find("camera"), std::string::npos);
}

}  // namespace
