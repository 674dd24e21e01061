// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Cost of a node that only passes frames on, compared with a virtual call. The difference between 50 nodes and one,
// divided by 49, is the cost per node; results.py measures GStreamer's `identity` in the same way.
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <tofgraph/pipeline.hpp>

#include <memory>
#include <vector>

namespace {

/// `intrinsics` without rectify changes the camera of the stream and leaves frames unchanged.
void pass_on(benchmark::State& state) {
  constexpr std::uint64_t frames = 20000;
  std::string line = fmt::format("simulator noise=none frames={}", frames);
  for (std::int64_t i = 0; i < state.range(0); ++i) line += fmt::format(" ! intrinsics k1=0 name=pass{}", i);
  for (auto _ : state) {
    tofgraph::Pipeline pipeline(line + " ! null", "camcube2");
    pipeline.plugin_path({TOFGRAPH_BINARY_DIR "/lib/tofgraph/plugins"});
    state.SetIterationTime(pipeline.run(0, static_cast<unsigned>(state.range(1))).seconds / frames);
  }
}

struct Stage {
  virtual ~Stage() = default;
  virtual void process(std::uint64_t& frame) = 0;
};
struct PassOn final : Stage {
  void process(std::uint64_t& frame) override { benchmark::DoNotOptimize(++frame); }
};
void virtual_call(benchmark::State& state) {
  std::vector<std::unique_ptr<Stage>> stages;
  for (std::int64_t i = 0; i < state.range(0); ++i) stages.push_back(std::make_unique<PassOn>());
  std::uint64_t frame = 0;
  for (auto _ : state) {
    for (const auto& stage : stages) stage->process(frame);
  }
}

BENCHMARK(pass_on)
    ->ArgNames({"nodes", "threads"})
    ->ArgsProduct({{1, 10, 50}, {1, 2}})
    ->Iterations(1)
    ->UseManualTime()
    ->Unit(benchmark::kNanosecond);
BENCHMARK(virtual_call)->ArgName("nodes")->Arg(1)->Arg(10)->Arg(50);

}  // namespace
