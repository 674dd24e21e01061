// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Both decoders warn if the distance increases with the amplitude within surfaces, and state by how much.
#include <gtest/gtest.h>
#include <tofgraph/harness.hpp>

#include "tests/unit/cameras.hpp"

#include <cmath>
#include <random>

using namespace tofgraph;

namespace {

constexpr double c_light = 299792458.0, pi = 3.14159265358979323846, frequency = 20e6;
constexpr std::size_t rows = 90, columns = 90;

/// Messages of a decoder for a slanted wall of dark and bright squares whose distance increases by `rise` (m) per
/// doubling of the amplitude.
std::string said_by(const std::string& stage, double rise) {
  const std::size_t steps = stage == "phase_decoder" ? 3 : 4;
  std::vector<tofgraph_exposure> exposures;
  for (std::size_t k = 0; k < steps; ++k)
    exposures.push_back({2 * pi * static_cast<double>(k) / static_cast<double>(steps), 0});
  std::mt19937 generator(1);
  std::normal_distribution<double> noise(0, 3);
  std::vector<float> samples;
  for (const tofgraph_exposure& exposure : exposures) {
    for (std::size_t i = 0; i < rows * columns; ++i) {
      const std::size_t row = i / columns, column = i % columns;
      const double amplitude = (row / 3 + column / 3) % 2 == 0 ? 2000 : 700;
      const double distance = 1.5 + 4e-3 * static_cast<double>(row) + 2e-3 * static_cast<double>(column) +
                              rise * std::log2(amplitude / 1000);
      const double psi = 4 * pi * frequency * distance / c_light;
      samples.push_back(static_cast<float>(amplitude * std::cos(psi + exposure.phase) + noise(generator)));
    }
  }
  test::Camera camera(columns, rows, 12.8e-3, 40e-6, {{"lamp", {0, 0, 0}, 1}});
  camera.view.exposures = exposures.data();
  camera.view.exposure_size = sizeof(tofgraph_exposure);
  camera.view.exposure_count = steps;
  Harness harness(stage);
  harness.camera(test::profile_of(camera.view));
  harness.metadata().modulation_frequency = frequency;
  harness.put<float>("phases", {steps, rows, columns}, samples);
  harness.run();
  std::string said;
  for (const std::string& message : harness.messages()) said += message + "\n";
  return said;
}

TEST(AmplitudeWalk, BothDecodersTellARiseAndItsSize) {
  const std::string words = "the distance rises by ";
  for (const std::string stage : {"four_phase_decoder", "phase_decoder"}) {
    for (const double rise : {5e-3, 20e-3}) {
      const std::string said = said_by(stage, rise);
      const std::size_t at = said.find(words);
      ASSERT_NE(at, std::string::npos) << stage << said;
      EXPECT_NEAR(std::stod(said.substr(at + words.size())), 1e3 * rise, 0.3) << stage << said;
      EXPECT_NE(said.find("tofgraph calibrate offset"), std::string::npos) << said;
    }
    // A decrease may be a depth edge, a small increase may be noise.
    for (const double rise : {0.0, -20e-3}) EXPECT_EQ(said_by(stage, rise).find(words), std::string::npos) << stage;
  }
}

}  // namespace
