// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Stages on images from 64 x 48 pixels to 4 megapixels on one core, compared with STREAM's triad: cost per pixel, and
// fraction of the memory bandwidth.
#include "tests/unit/cameras.hpp"

#include <benchmark/benchmark.h>
#include <tofgraph/harness.hpp>

#include <filesystem>
#include <fstream>

using namespace tofgraph;

namespace {

/// An image with the field of view of a CamCube.
struct Size {
  std::uint32_t width, height;
  std::size_t pixels() const { return std::size_t{width} * height; }
  std::vector<std::uint64_t> extent() const { return {height, width}; }
};
constexpr Size sizes[] = {{64, 48}, {204, 204}, {640, 480}, {1024, 1024}, {2048, 2048}};

std::vector<float> ramp(std::size_t pixels, double from, double to) {
  std::vector<float> values(pixels);
  for (std::size_t i = 0; i < pixels; ++i)
    values[i] = static_cast<float>(from + (to - from) * static_cast<double>(i) / static_cast<double>(pixels));
  return values;
}

/// Runs a stage. @param fill sets its input channels
/// @param bytes minimum to be read and written per pixel of the images and tables, reported as bytes_per_pixel
template <class Fill> void run(benchmark::State& state, const std::string& line, double bytes, const Fill& fill) {
  const Size size = sizes[state.range(0)];
  const test::Camera camera(size.width, size.height, 12.8e-3, 40e-6 * 204 / size.width,
                            {{"left", {-0.05, 0, 0}, 1}, {"right", {0.05, 0, 0}, 1}});
  Harness stage(line);
  stage.camera(test::profile_of(camera.view));
  stage.metadata().integration_time = 1e-3;
  stage.metadata().modulation_frequency = 20e6;
  stage.metadata().time_since_power_on = 600;
  fill(stage, size);
  for (int i = 0; i < 20; ++i) stage.run();  // memory is allocated; the decoder has checked the image order
  for (auto _ : state) stage.run();
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(size.pixels()));
  state.counters["pixels"] = static_cast<double>(size.pixels());
  state.counters["bytes_per_pixel"] = bytes;
}

void put_flags(Harness& stage, const Size& size) {
  stage.put<std::uint16_t>("flags", size.extent(), std::vector<std::uint16_t>(size.pixels()));
}

/// Reads four phases; writes distance, amplitude, sigma, flags.
void decoder(benchmark::State& state) {
  run(state, "four_phase_decoder", 4 * 4 + 3 * 4 + 2, [](Harness& stage, const Size& size) {
    const std::vector<float> phase = ramp(size.pixels(), 0.2, 6);
    std::vector<float> c;
    for (int k = 0; k < 4; ++k)
      for (const float psi : phase) c.push_back(1000 * std::cos(psi + static_cast<float>(k * M_PI / 2)));
    stage.put<float>("phases", {4, size.height, size.width}, c);
  });
}

/// Reads the amplitude; reads and writes distance, sigma, flags.
void model_correction(benchmark::State& state) {
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "sizes_benchmark.yaml";
  std::ofstream(file) << "model: 1\neffects: [{effect: warm_up, drift: 15 mm}, {effect: wiggling, amplitude: 6 mm}, "
                         "{effect: crosstalk, real: 250 counts/s, imaginary: -150 counts/s}]\n";
  run(state, "model_correction model=" + file.string(), 4 + 2 * (4 + 4 + 2), [](Harness& stage, const Size& size) {
    stage.put<float>("distance", size.extent(), ramp(size.pixels(), 0.4, 7));
    stage.put<float>("amplitude", size.extent(), ramp(size.pixels(), 9000, 60));
    stage.put<float>("sigma", size.extent(), ramp(size.pixels(), 1e-3, 0.03), {.of = "distance"});
    put_flags(stage, size);
  });
}

/// Reads the distance and five tables; reads and writes flags; writes the depth.
void optimized_bistatic(benchmark::State& state) {
  run(state, "optimized_bistatic", 4 + 5 * 4 + 2 * 2 + 4, [](Harness& stage, const Size& size) {
    stage.put<float>("distance", size.extent(), ramp(size.pixels(), 0.4, 7));
    put_flags(stage, size);
  });
}

/// Reads depth, flags, rays; writes points.
void point_cloud(benchmark::State& state) {
  run(state, "point_cloud", 4 + 2 + 12 + 12, [](Harness& stage, const Size& size) {
    stage.put<float>("depth", size.extent(), ramp(size.pixels(), 0.4, 7));
    put_flags(stage, size);
  });
}

/// a = b + s c as in STREAM, arrays of 128 MB: 24 bytes per element.
void triad(benchmark::State& state) {
  constexpr std::size_t n = std::size_t{1} << 24U;
  std::vector<double> a(n), b(n, 1.0), c(n, 2.0);
  for (auto _ : state) {
    for (std::size_t i = 0; i < n; ++i) a[i] = b[i] + 3.0 * c[i];
    benchmark::DoNotOptimize(a.data());
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(24 * n));
}

BENCHMARK(decoder)->DenseRange(0, 4)->Unit(benchmark::kMicrosecond);
BENCHMARK(model_correction)->DenseRange(0, 4)->Unit(benchmark::kMicrosecond);
BENCHMARK(optimized_bistatic)->DenseRange(0, 4)->Unit(benchmark::kMicrosecond);
BENCHMARK(point_cloud)->DenseRange(0, 4)->Unit(benchmark::kMicrosecond);
BENCHMARK(triad)->Unit(benchmark::kMillisecond);

}  // namespace
