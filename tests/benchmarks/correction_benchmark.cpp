// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Removing a model's effects, 204 x 204 pixels on one core: compilation of the tables, and correction of a frame;
// compared with the usual alternative, a polynomial of degree six for each pixel.
#include "simulation/correction.hpp"
#include "tests/unit/effect_fixture.hpp"

#include <benchmark/benchmark.h>
#include <tofgraph/harness.hpp>

#include <filesystem>
#include <fstream>

using namespace tofgraph;

namespace {

constexpr std::size_t pixels = std::size_t{204} * 204;

const char* const wave = "{effect: wiggling, amplitude: 10 mm, phase: 0.4 rad}";
const char* const weak_light =
    "{effect: wiggling, amplitude: 10 mm}, {effect: amplitude_walk, logarithmic: 16 mrad, "
    "inverse: 6 mrad}";
const char* const all =
    "{effect: wiggling, amplitude: 10 mm, phase: 0.4 rad}, {effect: phase_step_error, step1: 10 mrad}, "
    "{effect: phase_gain, gain2: 1 %}, {effect: tap_mismatch, ratio: 4 %}, {effect: even_harmonic, ratio: 0.04}, "
    "{effect: integration_time_offset, slope: 16 mm}, {effect: amplitude_walk, logarithmic: 16 mrad, inverse: 6 mrad}, "
    "{effect: crosstalk, real: 3000 counts/s, imaginary: 3000 counts/s}, {effect: zero_offset, offset: 40 mm}, "
    "{effect: static_reflection, strength: 3000 counts/s}, {effect: warm_up, drift: 20 mm, droop: 6 %}, "
    "{effect: adc_nonlinearity, quadratic: 6 %, cubic: 4 %}, {effect: source_amplitude, ratio: 20 %}, "
    "{effect: source_phase, difference: 100 mrad}, {effect: beam_profile, exponent: 4}, {effect: vignetting, exponent: "
    "8}, "
    "{effect: modulation_frequency, error: 2000 ppm}";

std::vector<float> ramp(double from, double to) {
  std::vector<float> values(pixels);
  for (std::size_t i = 0; i < pixels; ++i)
    values[i] = static_cast<float>(from + (to - from) * static_cast<double>(i) / pixels);
  return values;
}

void compile(benchmark::State& state, const char* effects) {
  const simulation::Correction correction(test::camcube(), false, test::effects(effects, test::camcube()));
  for (auto _ : state) benchmark::DoNotOptimize(correction.compile({1e-3, 20e6, 298, 600}));
}
BENCHMARK_CAPTURE(compile, wiggling, wave)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(compile, weak_light, weak_light)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(compile, all, all)->Unit(benchmark::kMillisecond);

void frame(benchmark::State& state, const char* effects) {
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "correction_benchmark.yaml";
  std::ofstream(file) << "model: 1\ncamera: camcube2\neffects: [" << effects << "]\n";
  Harness stage("model_correction model=" + file.string());
  stage.camera("camcube2");
  stage.metadata().integration_time = 1e-3;
  stage.metadata().modulation_frequency = 20e6;
  stage.metadata().time_since_power_on = 600;
  stage.put<float>("distance", {204, 204}, ramp(0.4, 7));
  stage.put<float>("amplitude", {204, 204}, ramp(9000, 60));
  stage.put<float>("sigma", {204, 204}, ramp(1e-3, 0.03), {.of = "distance"});
  stage.run();
  for (auto _ : state) stage.run();
}
BENCHMARK_CAPTURE(frame, wiggling, wave)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(frame, weak_light, weak_light)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(frame, all, all)->Unit(benchmark::kMicrosecond);

void polynomial_for_each_pixel(benchmark::State& state) {
  const std::vector<float> distance = ramp(0.4, 7), coefficients(7 * pixels, 0.01F);
  std::vector<float> corrected(pixels);
  for (auto _ : state) {
    for (std::size_t i = 0; i < pixels; ++i) {
      float value = 0;
      for (std::size_t k = 0; k < 7; ++k) value = value * distance[i] + coefficients[7 * i + k];
      corrected[i] = value;
    }
    benchmark::DoNotOptimize(corrected.data());
  }
}
BENCHMARK(polynomial_for_each_pixel)->Unit(benchmark::kMicrosecond);

}  // namespace
