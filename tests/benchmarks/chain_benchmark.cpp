// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// pipelines/full_chain.yaml in the graph compared with the same chain written by hand, on one and two threads; capture
// and clouds in memory (/dev/shm). Both are timed after start-up: tables are computed, files are open.
#include "io/profile.hpp"
#include "tests/benchmarks/chain_by_hand.hpp"
#include "tests/program.hpp"

#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <pcl/io/pcd_io.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/photo.hpp>
#include <tofgraph/pipeline.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <ctime>
#include <mutex>
#include <thread>

namespace {

using namespace tofgraph;
namespace fs = std::filesystem;
using Cloud = pcl::PointCloud<pcl::PointXYZI>;

constexpr unsigned frames = 600, start_frames = 40;  // the first frames of a run are its start-up
const fs::path source = TOFGRAPH_SOURCE_DIR;

/// Elapsed time, and processor time of all threads, which is less disturbed by other programs.
struct Seconds {
  double wall, processor;
};
Seconds now() {
  return {std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(),
          static_cast<double>(std::clock()) / CLOCKS_PER_SEC};
}
Seconds per_frame(const Seconds& start, unsigned count) {
  const Seconds end = now();
  return {(end.wall - start.wall) / count, (end.processor - start.processor) / count};
}

/// The capture, made once.
const fs::path& folder() {
  static const tests::TemporaryFolder it("/dev/shm");
  static const bool made = [] {
    const std::string command = fmt::format("\"$TOFGRAPH\" simulate '{}' -o capture.h5 --frames {}",
                                            (source / "pipelines/scenes/papers_while_warming.yaml").string(), frames);
    const tests::Outcome outcome = tests::shell(command, it.path());
    if (outcome.exit_code != 0) throw std::runtime_error(outcome.err);
    return true;
  }();
  if (!made) throw std::runtime_error("no capture");
  return it.path();
}

std::string cloud_file(const char* name, std::uint64_t frame) {
  return (folder() / fmt::format("{}_{:06}.pcd", name, frame)).string();
}

/// @returns s per frame, after start-up
Seconds run_graph(unsigned count, unsigned threads, std::int64_t capacity) {
  const fs::path file = folder() / fmt::format("chain_{}.yaml", capacity);
  if (!fs::exists(file)) {
    std::string text = tests::read_text(source / "pipelines/full_chain.yaml");
    const auto replace = [&text](const std::string& before, const std::string& after) {
      text.replace(text.find(before), before.size(), after);
    };
    replace("file: out/full_chain.h5",
            fmt::format("file: '{}', queue: {{capacity: {}}}", (folder() / "capture.h5").string(), capacity));
    replace("../devices", (source / "devices").string());
    replace("out/full_chain/cloud", (folder() / "graph").string());
    tests::write_text(file, text);
  }
  Pipeline pipeline(file.string());
  pipeline.plugin_path({TOFGRAPH_BINARY_DIR "/lib/tofgraph/plugins"});
  pipeline.overwrite(true);
  Seconds start{};
  pipeline.on_frame("cloud", [&start](const Frame& frame) {
    if (frame.metadata().number == start_frames - 1) start = now();
  });
  pipeline.run(count, threads);
  return per_frame(start, count - start_frames);
}

const by_hand::Chain& chain(bool bisection) {
  static const auto make = [](bool bisects) {
    config::Diagnostics diagnostics;
    const auto camera = io::load_profile(io::find_profile("camcube2", "."), diagnostics);
    return by_hand::Chain(camera->view(), source / "devices/calibrations/camcube2_offset.yaml", bisects);
  };
  static const by_hand::Chain newton = make(false), halving = make(true);
  return bisection ? halving : newton;
}

/// Frames are distributed to the threads, the best manual parallelisation; HDF5 serves one thread at a time.
Seconds run_by_hand(unsigned count, unsigned threads, bool bisection) {
  cv::setNumThreads(1);
  const by_hand::Capture capture(folder() / "capture.h5");
  const by_hand::Chain& each = chain(bisection);
  const Seconds start = now();
  std::atomic<unsigned> next = 0;
  std::mutex reading;
  {
    std::vector<std::jthread> workers;
    for (unsigned t = 0; t < threads; ++t) {
      workers.emplace_back([&] {
        std::vector<float> phases(4 * by_hand::side * by_hand::side);
        Cloud cloud;
        for (unsigned frame = next++; frame < count; frame = next++) {
          {
            const std::scoped_lock lock(reading);
            capture.read(frame, phases.data());
          }
          each(phases.data(), cloud);
          pcl::PCDWriter().writeBinary(cloud_file("hand", frame), cloud);
        }
      });
    }
  }
  return per_frame(start, count);
}

/// Quantile of the distances between two clouds, in m.
double difference(const Cloud& a, const Cloud& b, double share) {
  std::vector<double> all;
  for (std::size_t i = 0; i < a.size(); ++i)
    all.push_back(
        std::hypot(double{a[i].x} - double{b[i].x}, double{a[i].y} - double{b[i].y}, double{a[i].z} - double{b[i].z}));
  const auto at = all.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(all.size() - 1));
  std::ranges::nth_element(all, at);
  return *at;
}

/// Both sides compute the same: before the denoisers half of the pixels agree to 0.1 mm and 90 % to 0.3 mm, because
/// cv::cartToPolar is accurate to 0.01 deg and cv::blur mixes surfaces at their edges; after them half agree to 1 mm,
/// because OpenCV compares patches with another norm.
void compare(benchmark::State& state) {
  for (auto _ : state) {
    const std::string tail = " --frames 1 --force";
    tests::Outcome outcome =
        tests::shell(fmt::format("\"$TOFGRAPH\" run '{}' --set grab.file={} --set 'save.path={}' --set "
                                 "denoise.search=1 --set denoise.patch=1{}",
                                 (source / "pipelines/full_chain.yaml").string(), (folder() / "capture.h5").string(),
                                 (folder() / "raw_{frame:06}.pcd").string(), tail),
                     folder());
    if (outcome.exit_code != 0) throw std::runtime_error(outcome.err);
  }
  std::vector<float> phases(4 * by_hand::side * by_hand::side);
  Cloud hand, graph, hand_raw, graph_raw;
  by_hand::Capture(folder() / "capture.h5").read(0, phases.data());
  chain(false)(phases.data(), hand_raw, false);
  chain(false)(phases.data(), hand);
  run_graph(start_frames + 1, 1, 4);
  if (pcl::io::loadPCDFile(cloud_file("graph", 0), graph) != 0 ||
      pcl::io::loadPCDFile(cloud_file("raw", 0), graph_raw) != 0)
    throw std::runtime_error("no cloud");
  const double raw_half = difference(hand_raw, graph_raw, 0.5), raw_most = difference(hand_raw, graph_raw, 0.9),
               half = difference(hand, graph, 0.5);
  state.counters["before_denoising_median_mm"] = raw_half * 1e3;
  state.counters["before_denoising_90_percent_mm"] = raw_most * 1e3;
  state.counters["median_mm"] = half * 1e3;
  if (!(raw_half < 1e-4 && raw_most < 3e-4 && half < 1e-3))
    state.SkipWithError("the two chains do not compute the same");
}
BENCHMARK(compare)->Iterations(1)->Unit(benchmark::kMillisecond);

void count_frames(benchmark::State& state, const Seconds& seconds) {
  state.SetIterationTime(seconds.wall);
  state.counters["frames/s"] = 1 / seconds.wall;
  state.counters["processor_ms"] = seconds.processor * 1e3;
}
void graph(benchmark::State& state) {
  for (auto _ : state) count_frames(state, run_graph(frames, static_cast<unsigned>(state.range(0)), state.range(1)));
}
void hand(benchmark::State& state, bool bisection) {
  for (auto _ : state) count_frames(state, run_by_hand(100, static_cast<unsigned>(state.range(0)), bisection));
}
BENCHMARK(graph)
    ->ArgNames({"threads", "queue"})
    ->ArgsProduct({{1, 2}, {4}})
    ->ArgsProduct({{2}, {1, 2, 8, 16}})
    ->Iterations(1)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(hand, newton, false)
    ->ArgName("threads")
    ->Arg(1)
    ->Arg(2)
    ->Iterations(1)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(hand, bisection, true)
    ->ArgName("threads")
    ->Arg(2)
    ->Iterations(1)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
