// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The digital twin: a frame with noise and five effects, and one evaluation as in a search.
#include <benchmark/benchmark.h>

#include "io/profile.hpp"
#include "simulation/board.hpp"
#include "simulation/files/model.hpp"
#include "simulation/frames.hpp"

using namespace tofgraph;
using namespace tofgraph::simulation;

namespace {

const tofgraph_camera& camera() {
  static const auto profile = io::load_profile(io::find_profile("camcube2", {}));
  return profile->view();
}

/// Five effects, one per level; with or without a nonlinear converter, which requires every frame's taps.
std::vector<EffectPtr> five_effects(bool readout) {
  const std::string text =
      std::string(
          "model: 1\neffects:\n  - {effect: wiggling, amplitude: 5 mm}\n"
          "  - {effect: amplitude_walk, logarithmic: 8 mrad}\n"
          "  - {effect: source_position, separation: 4 mm}\n"
          "  - {effect: tap_mismatch, ratio: 2 %}\n") +
      (readout ? "  - {effect: adc_nonlinearity, quadratic: 3 %}\n" : "  - {effect: vignetting, exponent: 4}\n");
  config::Diagnostics diagnostics;
  const Model model =
      read_model(config::parse_document("model", text), graph::PluginRegistry(graph::plugin_path({})), diagnostics);
  auto effects = make_effects(model, camera(), diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  return effects;
}

const BoardPose board{1, 0, 0, 0.85};

/// Everything: light, effects, noise, counts.
void OneFrame(benchmark::State& state, bool readout) {
  const ForwardModel model(camera(), false, five_effects(readout));
  const Pixels pixels = whole_image(camera());
  const Tracer tracer = board_tracer(camera().focal_length, board);
  const Acquisition acquisition = acquisition_of(camera(), 1e-3);
  std::vector<float> phases(4 * pixels.size());
  for (auto _ : state) {
    const Frames frames(model, tracer, acquisition, pixels, {3, 0.012}, {1, 0});
    frames.phases(0, phases.data());
    benchmark::DoNotOptimize(phases.data());
  }
}

/// Another frame of the same condition.
void FurtherFrame(benchmark::State& state, bool readout) {
  const ForwardModel model(camera(), false, five_effects(readout));
  const Pixels pixels = whole_image(camera());
  const Frames frames(model, board_tracer(camera().focal_length, board), acquisition_of(camera(), 1e-3), pixels,
                      {3, 0.012}, {1, 0});
  std::vector<float> phases(4 * pixels.size());
  std::uint64_t number = 0;
  for (auto _ : state) {
    frames.phases(number++, phases.data());
    benchmark::DoNotOptimize(phases.data());
  }
}

/// Evaluation as in a search: 12 x 12 superpixels, one condition, no noise, new effects.
void CoarseCondition(benchmark::State& state) {
  const Pixels pixels = superpixels(camera(), 12, 12);
  const Tracer tracer = board_tracer(camera().focal_length, board);
  const Acquisition acquisition = acquisition_of(camera(), 1e-3);
  const auto effects = five_effects(true);
  for (auto _ : state) {
    const ForwardModel model(camera(), false, effects);
    Expectation expectation = model.expect(tracer, acquisition, pixels);
    model.read_out(acquisition, pixels, expectation.taps);
    benchmark::DoNotOptimize(expectation.taps.data());
  }
}

BENCHMARK_CAPTURE(OneFrame, five_effects, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(OneFrame, five_effects_with_readout, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(FurtherFrame, five_effects, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(FurtherFrame, five_effects_with_readout, true)->Unit(benchmark::kMillisecond);
BENCHMARK(CoarseCondition)->Unit(benchmark::kMillisecond);

}  // namespace
