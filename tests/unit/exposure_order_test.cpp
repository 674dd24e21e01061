// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// A decoder with wrongly declared exposures warns and suggests the right ones; with the right ones it is silent.
#include <gtest/gtest.h>
#include <tofgraph/harness.hpp>

#include "tests/unit/cameras.hpp"

#include <cmath>
#include <functional>
#include <random>

using namespace tofgraph;

namespace {

constexpr double c_light = 299792458.0, pi = 3.14159265358979323846, deg = pi / 180;
constexpr std::size_t rows = 60, columns = 80;
constexpr double gain = 7e6, integration_time = 1e-3;
using Steps = std::vector<tofgraph_exposure>;

Steps steps_of(const std::vector<double>& degrees, double frequency = 0) {
  Steps steps;
  for (const double d : degrees) steps.push_back({d * deg, frequency});
  return steps;
}

struct Pixel {
  double distance, reflectivity;
};
using Scene = std::function<Pixel(std::size_t row, std::size_t column)>;

/// A floor from 1 to 3.5 m with a slightly uneven surface.
Pixel floor_of(std::size_t row, std::size_t column) {
  const double uneven = 0.1 * std::sin(0.9 * static_cast<double>(column)) * std::cos(0.7 * static_cast<double>(row));
  return {1 + 2.5 * static_cast<double>(row) / rows, 0.5 + uneven};
}

std::vector<float> samples_of(const Steps& taken, const Scene& scene, double noise = 3, double offset = 0) {
  std::mt19937 generator(1);
  std::normal_distribution<double> normal(0, noise);
  std::vector<float> samples;
  for (const auto& [phase, frequency] : taken) {
    for (std::size_t row = 0; row < rows; ++row) {
      for (std::size_t column = 0; column < columns; ++column) {
        const auto [distance, reflectivity] = scene(row, column);
        const double amplitude = gain * reflectivity * integration_time / (4 * distance * distance);
        const double psi = 4 * pi * (frequency > 0 ? frequency : 20e6) * (distance + offset) / c_light;
        samples.push_back(static_cast<float>(amplitude * std::cos(psi + phase) + normal(generator)));
      }
    }
  }
  return samples;
}

struct Answer {
  std::string warning;
  std::vector<float> distance;
};

/// @param said exposures stated by the profile
Answer decode(const Steps& said, const std::vector<float>& samples, const std::string& stage,
              double camera_gain = gain) {
  static std::vector<std::unique_ptr<test::Camera>> cameras;
  auto& camera = *cameras.emplace_back(
      std::make_unique<test::Camera>(static_cast<std::uint32_t>(columns), static_cast<std::uint32_t>(rows), 12.8e-3,
                                     40e-6, std::vector<tofgraph_light>{{"lamp", {0, 0, 0}, 1}}));
  camera.view.exposures = said.data();
  camera.view.exposure_size = sizeof(tofgraph_exposure);
  camera.view.exposure_count = said.size();
  camera.view.gain = camera_gain;
  camera.view.modulation_frequency = said[0].frequency > 0 ? said[0].frequency : 20e6;
  Harness harness(stage);
  harness.camera(test::profile_of(camera.view));
  harness.metadata().modulation_frequency = 20e6;
  harness.metadata().integration_time = integration_time;
  harness.put<float>("phases", {said.size(), rows, columns}, samples);
  harness.run();
  Answer answer{"", harness.get<float>("distance")};
  for (const std::string& message : harness.messages()) answer.warning += message + "\n";
  return answer;
}

/// The exposures suggested by a warning.
Steps suggested(const std::string& warning) {
  Steps steps;
  std::size_t at = warning.find("exposures: [");
  while (at != std::string::npos && (at = warning.find("{phase: ", at)) != std::string::npos) {
    at += 8;
    const double phase = std::stod(warning.substr(at)) * deg;
    const std::size_t end = warning.find('}', at), frequency = warning.find("frequency: ", at);
    steps.push_back({phase, frequency < end ? std::stod(warning.substr(frequency + 11)) * 1e6 : 0});
  }
  return steps;
}

/// Declared `said`, actual `taken`: the exposures suggested by the warning give the right distances.
void expect_told(const Steps& taken, const Steps& said, const std::string& words, const std::string& stage,
                 const Scene& scene = floor_of, double camera_gain = gain) {
  const auto samples = samples_of(taken, scene);
  const Answer answer = decode(said, samples, stage, camera_gain);
  ASSERT_NE(answer.warning.find(words), std::string::npos) << "warning: " << answer.warning;
  const Steps better = suggested(answer.warning);
  ASSERT_EQ(better.size(), taken.size()) << answer.warning;
  const Answer right = decode(better, samples, stage, camera_gain);
  EXPECT_EQ(right.warning, "");
  std::size_t good = 0;
  for (std::size_t i = 0; i < rows * columns; ++i)
    good += std::abs(right.distance[i] - scene(i / columns, i % columns).distance) < 0.15 ? 1 : 0;
  EXPECT_GT(good, rows * columns * 99 / 100) << answer.warning;
}

TEST(ExposureOrder, TheOtherDirectionIsTold) {
  expect_told(steps_of({0, 270, 180, 90}), steps_of({0, 90, 180, 270}), "turned the other way", "four_phase_decoder");
  expect_told(steps_of({0, 270, 180, 90}), steps_of({0, 90, 180, 270}), "turned the other way", "phase_decoder");
  expect_told(steps_of({0, 240, 120}), steps_of({0, 120, 240}), "turned the other way", "phase_decoder");
  expect_told(steps_of({0, 270, 180, 90}), steps_of({0, 90, 180, 270}), "turned the other way", "four_phase_decoder",
              floor_of, std::nan(""));
}

TEST(ExposureOrder, ExchangedImagesAreTold) {
  expect_told(steps_of({0, 180, 90, 270}), steps_of({0, 90, 180, 270}), "images or taps were swapped",
              "four_phase_decoder");
  expect_told(steps_of({90, 0, 180, 270}), steps_of({0, 90, 180, 270}), "images or taps were swapped",
              "four_phase_decoder");
  expect_told(steps_of({0, 72, 216, 144, 288}), steps_of({0, 72, 144, 216, 288}), "images or taps were swapped",
              "phase_decoder");
}

Steps bands(const std::vector<double>& frequencies, const std::vector<double>& degrees) {
  Steps steps;
  for (const double frequency : frequencies)
    for (const double phase : degrees) steps.push_back({phase * deg, frequency});
  return steps;
}
const Steps nine = bands({80e6, 16e6, 120e6}, {0, 120, 240});

TEST(ExposureOrder, ExchangedImagesOfSeveralFrequenciesAreTold) {
  Steps taken = nine;
  std::swap(taken[1], taken[4]);
  expect_told(taken, nine, "images or taps were swapped", "phase_decoder");
  expect_told(bands({16e6, 80e6, 120e6}, {0, 120, 240}), nine, "images or taps were swapped", "phase_decoder");
  Steps by_turns;
  for (const double phase : {0.0, 120.0, 240.0})
    for (const double frequency : {80e6, 16e6, 120e6}) by_turns.push_back({phase * deg, frequency});
  expect_told(by_turns, nine, "images or taps were swapped", "phase_decoder");
}

TEST(ExposureOrder, SeveralFrequenciesTheOtherWayOrWithExchangedTapsAreTold) {
  expect_told(bands({80e6, 16e6, 120e6}, {0, 240, 120}), nine, "turned the other way", "phase_decoder");
  expect_told(bands({80e6, 16e6, 120e6}, {180, 300, 60}), nine, "images or taps were swapped", "phase_decoder");
  const Scene room = [](auto row, auto column) {
    return Pixel{1.2 + 0.9 * static_cast<double>(row) / rows, floor_of(row, column).reflectivity};
  };
  expect_told(bands({80e6, 16e6, 120e6}, {0, 240, 120}), nine, "turned the other way", "phase_decoder", room);
}

TEST(ExposureOrder, LateImagesAreTold) {
  std::vector<double> eight, late;
  for (int k = 0; k < 8; ++k) {
    eight.push_back(45.0 * k);
    late.push_back(45.0 * ((k + 2) % 8));
  }
  expect_told(steps_of(late), steps_of(eight), "", "phase_decoder");
  expect_told(steps_of({144, 216, 288, 0, 72}), steps_of({0, 72, 144, 216, 288}), "", "phase_decoder");
}

TEST(ExposureOrder, WhatNoOrderExplainsIsSaidWithoutOne) {
  std::mt19937 generator(8);
  std::uniform_real_distribution<float> any(-1000, 1000);
  std::vector<float> nonsense(4 * rows * columns);
  for (float& value : nonsense) value = any(generator);
  const Answer answer = decode(steps_of({0, 90, 180, 270}), nonsense, "four_phase_decoder");
  EXPECT_NE(answer.warning.find("no other order was found that fits"), std::string::npos) << answer.warning;
}

TEST(ExposureOrder, ExchangedTapsAreTold) {
  expect_told(steps_of({180, 270, 0, 90}), steps_of({0, 90, 180, 270}), "brighter than white", "four_phase_decoder");
  expect_told(steps_of({180, 300, 60}), steps_of({0, 120, 240}), "brighter than white", "phase_decoder");
  const Scene even = [](std::size_t row, std::size_t) { return Pixel{1 + 2.5 * static_cast<double>(row) / rows, 0.5}; };
  expect_told(steps_of({180, 270, 0, 90}), steps_of({0, 90, 180, 270}), "decreases too fast", "four_phase_decoder",
              even, std::nan(""));
}

TEST(ExposureOrder, AWallThatIsTooBrightIsToldWithoutAnOrder) {
  const Scene wall = [](auto, auto) { return Pixel{2, 0.85}; };
  const Answer answer =
      decode(steps_of({0, 90, 180, 270}), samples_of(steps_of({0, 270, 180, 90}), wall), "four_phase_decoder");
  EXPECT_NE(answer.warning.find("6 times brighter than white"), std::string::npos) << answer.warning;
  EXPECT_NE(answer.warning.find("no other order was found"), std::string::npos) << answer.warning;
}

/// A dark object before a bright wall resembles a reversed direction; exchanged images alone must not suggest one.
TEST(ExposureOrder, ExchangedImagesDoNotTurnTheDirection) {
  const Scene ball = [](auto row, auto column) {
    const bool near = column > 25 && column < 50 && row > 15 && row < 45;
    return near ? Pixel{1.5, 0.05} : Pixel{3.4 + 0.002 * static_cast<double>(column), 0.8};
  };
  const Steps six = bands({100e6, 80e6}, {0, 120, 240});
  Steps taken = six;
  std::swap(taken[1], taken[3]);
  expect_told(taken, six, "images or taps were swapped", "phase_decoder", ball);
}

TEST(ExposureOrder, RightOnesAreLeftInPeace) {
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> any(0, 1);
  std::vector<double> texture(rows * columns), patches(100);
  for (double& t : texture) t = 0.05 + 0.85 * any(generator);
  for (double& p : patches) p = 0.05 + 0.85 * any(generator);
  const std::vector<std::pair<const char*, Scene>> scenes = {
      {"floor", floor_of},
      {"board",
       [](auto, auto) {
         return Pixel{1.5, 0.85};
       }},
      {"dark board",
       [](auto, auto) {
         return Pixel{3.5, 0.06};
       }},
      {"texture",
       [&](auto row, auto column) {
         return Pixel{2, texture[row * columns + column]};
       }},
      {"patches on the floor",
       [&](auto row, auto column) {
         return Pixel{floor_of(row, column).distance, patches[row / 6 * 10 + column / 8]};
       }},
      {"bright behind dark",
       [](auto, auto column) {
         return column < 40 ? Pixel{1.0, 0.06} : Pixel{1.6, 0.9};
       }},
      {"beyond the range",
       [](auto row, auto) {
         return Pixel{5 + 5.0 * static_cast<double>(row) / rows, 0.8};
       }},
      {"steps",
       [](auto row, auto) {
         return Pixel{0.5 + 0.7 * static_cast<double>(row / 6), 0.5};
       }},
  };
  for (const auto& [name, scene] : scenes) {
    for (const double offset : {0.0, 0.15, -0.15}) {
      for (const double noise : {1.0, 10.0}) {
        const Steps four = steps_of({0, 90, 180, 270}), three = steps_of({0, 120, 240});
        EXPECT_EQ(decode(four, samples_of(four, scene, noise, offset), "four_phase_decoder").warning, "") << name;
        EXPECT_EQ(decode(three, samples_of(three, scene, noise, offset), "phase_decoder").warning, "") << name;
        EXPECT_EQ(decode(nine, samples_of(nine, scene, noise, offset), "phase_decoder").warning, "") << name;
      }
    }
  }
}

TEST(ExposureOrder, NothingIsSaidOfTooLittle) {
  const Steps four = steps_of({0, 90, 180, 270});
  EXPECT_EQ(decode(four, std::vector<float>(4 * rows * columns, 0), "four_phase_decoder").warning, "");
  std::mt19937 generator(5);
  std::normal_distribution<float> normal(0, 3);
  std::vector<float> noise(4 * rows * columns);
  for (float& value : noise) value = normal(generator);
  EXPECT_EQ(decode(four, noise, "four_phase_decoder").warning, "");
}

}  // namespace
