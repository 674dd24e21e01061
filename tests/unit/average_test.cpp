// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Compared with mean and standard deviation of the raw values in long double.
#include <tofgraph/harness.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/program.hpp"

namespace tofgraph {
namespace {

constexpr std::size_t rows = 5, columns = 7, pixels = rows * columns;

using Image = std::vector<float>;

/// Frames near 7 m with noise of a few millimetres; a tenth of the pixels is invalid.
std::vector<Image> recording(std::size_t frames) {
  std::mt19937 random(7);
  std::normal_distribution<float> noise(7.0F, 0.003F);
  std::vector<Image> all(frames, Image(pixels));
  for (std::size_t f = 0; f < frames; ++f) {
    for (std::size_t i = 0; i < pixels; ++i) all[f][i] = (f + i) % 10 == 0 || i == 3 ? NAN : noise(random);
  }
  return all;
}

struct Reference {
  long double mean = 0, deviation = 0;
  int valid = 0;
};

Reference reference(const std::vector<Image>& frames, std::size_t first, std::size_t last, std::size_t pixel) {
  Reference r;
  for (std::size_t f = first; f < last; ++f) {
    if (!std::isfinite(frames[f][pixel])) continue;
    r.mean += frames[f][pixel];
    ++r.valid;
  }
  r.mean /= r.valid;
  for (std::size_t f = first; f < last; ++f) {
    if (std::isfinite(frames[f][pixel])) r.deviation += (frames[f][pixel] - r.mean) * (frames[f][pixel] - r.mean);
  }
  r.deviation = std::sqrt(r.deviation / (r.valid - 1) / r.valid);
  return r;
}

void expect_mean(const Harness& stage, const std::vector<Image>& frames, std::size_t first, std::size_t last) {
  const auto depth = stage.get<float>("depth"), sigma = stage.get<float>("sigma");
  const auto flags = stage.get<std::uint16_t>("flags");
  for (std::size_t i = 0; i < pixels; ++i) {
    const Reference r = reference(frames, first, last, i);
    if (r.valid == 0) {
      EXPECT_TRUE(std::isnan(depth[i]) && std::isnan(sigma[i]) && (flags[i] & 1) != 0) << i;
      continue;
    }
    EXPECT_NEAR(depth[i], static_cast<double>(r.mean), 3e-7) << i;  // half a step of float at 7 m
    EXPECT_EQ(flags[i] & 1, 0) << i;
    if (r.valid > 1) {
      EXPECT_NEAR(sigma[i], static_cast<double>(r.deviation), 1e-6 * static_cast<double>(r.deviation)) << i;
    }
  }
}

TEST(Average, GivesOneFrameForEveryN) {
  const auto frames = recording(24);
  Harness stage("average frames=8");
  int given = 0;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    stage.put<float>("depth", {rows, columns}, frames[f]);
    if (!stage.run()) continue;
    ++given;
    EXPECT_EQ(f % 8, 7U);
    expect_mean(stage, frames, f - 7, f + 1);
  }
  EXPECT_EQ(given, 3);
  EXPECT_EQ(stage.of("sigma"), "depth");
}

TEST(Average, RunningIsTheMeanOfTheLastN) {
  const auto frames = recording(40);
  Harness stage("average frames=6 running=true");
  for (std::size_t f = 0; f < frames.size(); ++f) {
    stage.put<float>("depth", {rows, columns}, frames[f]);
    ASSERT_TRUE(stage.run());
    expect_mean(stage, frames, f < 6 ? 0 : f - 5, f + 1);
  }
}

/// Compared with the mean of the same values away from the end of the range, shifted back.
TEST(Average, DistancesAtTheEndOfTheUnambiguousRangeStayThere) {
  constexpr double frequency = 299792458.0 / 15, range = 7.5, shift = 2;  // Hz, m, m
  const std::vector<Image> noisy = recording(12);                         // near 7 m
  for (const double end : {0.492, 0.4998, 0.502, 0.508}) {                // m, added to reach the end of the range
    for (const char* line : {"average frames=12", "average frames=12 running=true"}) {
      std::vector<Image> inside(noisy.size(), Image(pixels));
      Harness stage(line);
      stage.metadata().modulation_frequency = frequency;
      for (std::size_t f = 0; f < noisy.size(); ++f) {
        Image wrapped(pixels);
        for (std::size_t i = 0; i < pixels; ++i) {
          const double value = static_cast<double>(noisy[f][i]) + end;
          wrapped[i] = static_cast<float>(std::fmod(value, range));
          inside[f][i] = static_cast<float>(value - shift);
        }
        stage.put<float>("distance", {rows, columns}, wrapped);
        stage.run();
      }
      const auto distance = stage.get<float>("distance"), sigma = stage.get<float>("sigma");
      for (std::size_t i = 0; i < pixels; ++i) {
        const Reference r = reference(inside, 0, inside.size(), i);
        if (r.valid == 0) {
          EXPECT_TRUE(std::isnan(distance[i])) << line;
          continue;
        }
        const double error = static_cast<double>(distance[i]) - (static_cast<double>(r.mean) + shift);
        EXPECT_TRUE(distance[i] >= 0 && distance[i] < range) << distance[i];
        EXPECT_NEAR(std::remainder(error, range), 0, 2e-6) << line << ' ' << end;
        EXPECT_NEAR(sigma[i], static_cast<double>(r.deviation), 1e-6) << line << ' ' << end;
      }
    }
  }
}

/// Mean of two frames.
float mean_of(const std::string& channel, double frequency, float first, float second,
              const std::string& applied = {}) {
  Harness stage("average frames=2");
  for (const float length : {first, second}) {
    stage.put<float>(channel, {1, 1}, {length}, {.applied = applied});
    stage.metadata().modulation_frequency = frequency;
    stage.run();
  }
  return stage.get<float>(channel)[0];
}

TEST(Average, OnlyDistancesOfAKnownRangeWrap) {
  constexpr double frequency = 299792458.0 / 15;  // Hz: 7.5 m
  EXPECT_NEAR(mean_of("distance", frequency, 0.02F, 7.49F), 0.005, 1e-6);
  EXPECT_NEAR(mean_of("distance", frequency, 7.49F, 0.02F), 0.005, 1e-6);
  EXPECT_NEAR(mean_of("distance", frequency, 7.47F, 0.02F), 7.495, 1e-6);
  EXPECT_NEAR(mean_of("distance", frequency, 7.49F, 7.53F), 7.51, 1e-6) << "corrected by an offset";
  EXPECT_NEAR(mean_of("distance", frequency / 2, 0.02F, 7.48F), 3.75, 1e-6);
  EXPECT_NEAR(mean_of("distance", NAN, 0.02F, 7.48F), 3.75, 1e-6);
  EXPECT_NEAR(mean_of("depth", frequency, 0.02F, 7.48F), 3.75, 1e-6);
  EXPECT_NEAR(mean_of("distance", frequency, 2.0F, 9.0F, "hdr_fusion unwrapped"), 5.5, 1e-6)
      << "of several frequencies";
}

TEST(Average, JoinsFlagsAndAveragesTheAmplitude) {
  Harness stage("average frames=2");
  for (std::uint16_t f = 0; f < 2; ++f) {
    stage.put<float>("depth", {1, 2}, {1.0F, f == 0 ? NAN : 2.0F});
    stage.put<float>("amplitude", {1, 2}, {100.0F + f, 10.0F});
    stage.put<std::uint16_t>(
        "flags", {1, 2}, {f == 0 ? std::uint16_t{8} : std::uint16_t{2}, f == 0 ? std::uint16_t{1} : std::uint16_t{0}});
    EXPECT_EQ(stage.run(), f == 1);
  }
  EXPECT_EQ(stage.get<float>("amplitude"), (Image{100.5F, 10.0F}));
  EXPECT_EQ(stage.get<std::uint16_t>("flags"), (std::vector<std::uint16_t>{10, 0}));
  EXPECT_EQ(stage.get<float>("depth"), (Image{1.0F, 2.0F}));
}

TEST(Average, ASingleValidValueKeepsItsSigma) {
  for (const char* line : {"average frames=2", "average frames=2 running=true"}) {
    Harness stage(line);
    for (const float depth : {1.0F, NAN}) {
      stage.put<float>("depth", {1, 1}, {depth});
      stage.put<float>("sigma", {1, 1}, {depth * 0.003F}, {.of = "depth"});
      stage.run();
    }
    EXPECT_EQ(stage.get<float>("depth"), Image{1.0F}) << line;
    EXPECT_EQ(stage.get<float>("sigma"), Image{0.003F}) << line;
  }
}

TEST(Average, LeavesAmplitudesOutThatAreNoNumbers) {
  for (const char* line : {"average frames=3", "average frames=3 running=true"}) {
    Harness stage(line);
    Image last;
    for (const float light : {NAN, 10.0F, 30.0F, 50.0F, 70.0F, 90.0F}) {
      stage.put<float>("depth", {1, 2}, {1.0F, 1.0F});
      stage.put<float>("amplitude", {1, 2}, {light, NAN});
      const bool given = stage.run();
      if (given) last = stage.get<float>("amplitude");
      if (given && light == 30) {
        EXPECT_EQ(last[0], 20) << line;
      }
    }
    EXPECT_EQ(last[0], 70) << line;
    EXPECT_TRUE(std::isnan(last[1])) << line;
  }
}

TEST(Average, ARunningMeanForgetsWhatHasLeftItsWindow) {
  // A glitch of 1e6 m costs the running sum of squares four digits more than millimetres do unless it is recomputed.
  Harness stage("average frames=5 running=true");
  auto frames = recording(200);
  for (std::size_t i = 0; i < pixels; ++i) frames[20][i] = 1e6F;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    stage.put<float>("depth", {rows, columns}, frames[f]);
    ASSERT_TRUE(stage.run());
    if (f > 100) expect_mean(stage, frames, f - 4, f + 1);
  }
}

TEST(Average, TellsHowManyFramesAreLeftOver) {
  Harness stage("average frames=4");
  for (int f = 0; f < 7; ++f) {
    stage.put<float>("depth", {1, 1}, {1.0F});
    stage.run();
  }
  stage.finish();
  ASSERT_EQ(stage.messages().size(), 1U);
  EXPECT_NE(stage.messages()[0].find("the last 3 frames discarded: too few for a mean of 4"), std::string::npos)
      << stage.messages()[0];
}

TEST(Average, RefusesARecordingThatIsShorterThanOneMean) {
  const auto check = [](int frames) {
    return tests::shell("$TOFGRAPH check 'simulator output=distance frames=" + std::to_string(frames) +
                            " ! average frames=8 ! null' --camera camcube2",
                        "/tmp");
  };
  const tests::Outcome short_one = check(7);
  EXPECT_EQ(short_one.exit_code, 2);
  EXPECT_NE(short_one.err.find("7 frames in all, not enough for one mean of 8"), std::string::npos) << short_one.err;
  EXPECT_EQ(check(8).exit_code, 0);
}

TEST(Average, RefusesSenselessNumbers) {
  EXPECT_THROW(Harness("average frames=0"), std::runtime_error);
  Harness endless("average frames=5000 running=true");
  endless.put<float>("depth", {1, 1}, {1.0F});
  EXPECT_THROW(endless.run(), std::runtime_error);
}

}  // namespace
}  // namespace tofgraph
