// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The simpler stages of the measuring chain, each alone through the plugin interface, 204 x 204 pixels.
#include <tofgraph/harness.hpp>

#include <benchmark/benchmark.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

namespace {

constexpr std::size_t size = 204, pixels = size * size;
const std::string calibration = TOFGRAPH_SOURCE_DIR "/devices/calibrations/camcube2_offset.yaml";

std::vector<float> noisy(float mean, float deviation) {
  std::mt19937 random(1);
  std::normal_distribution<float> noise(mean, deviation);
  std::vector<float> values(pixels);
  for (float& v : values) v = noise(random);
  return values;
}

/// Calibration of 5 000 boards at random depths, times and reflectivities.
std::string scattered_calibration() {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(0, 1);
  std::string lists[5];  // target, distance, depth, integration time, reflectivity
  for (int i = 0; i < 5000; ++i) {
    const double z = 0.5 + 1.5 * any(random), values[] = {0, z + 0.01 * std::sin(5 * z), z, std::pow(8, any(random)),
                                                          0.1 * std::pow(8, any(random))};
    for (int list = 0; list < 5; ++list) lists[list] += (i > 0 ? ", " : "[") + std::to_string(values[list]);
    if (i > 0) continue;  // the same board at two times
    for (int list = 0; list < 5; ++list)
      lists[list] += ", " + std::to_string(values[list] * (list == 3 ? 1.1 : 1) + (list == 2 ? 1e-4 : 0));
  }
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "scattered_offsets.yaml";
  std::ofstream(file)
      << "calibration: 1\nkind: offset\ncamera: camcube2\nsettings: {variant: geometric, targets: [board]}"
      << "\nvalues:\n  modulation_frequency: {value: 20 MHz}\n  gain: {value: 7000000 counts m^2/s}"
      << "\n  falloff: {value: [0, 0]}\n  target: {value: " << lists[0]
      << "]}\n  distance: {unit: m, value: " << lists[1] << "]}\n  depth: {unit: m, value: " << lists[2]
      << "]}\n  integration_time: {unit: ms, value: " << lists[3] << "]}\n  reflectivity: {value: " << lists[4]
      << "]}\n";
  return file.string();
}

/// Runs a stage on a frame with distance or depth, amplitude, sigma and flags, as produced by the chain.
/// @param spread of the lengths, m
void run(benchmark::State& state, const std::string& line, const std::string& length, float spread = 0.01F) {
  tofgraph::Harness stage(line);
  stage.camera("camcube2");
  stage.put<float>(length, {size, size}, noisy(1.0F, spread));
  stage.put<float>("amplitude", {size, size}, noisy(1000, 50));
  stage.put<float>("sigma", {size, size}, std::vector<float>(pixels, 0.003F),
                   {.unit = "m", .of = length, .applied = "", .from = ""});
  stage.put<std::uint16_t>("flags", {size, size}, std::vector<std::uint16_t>(pixels, 0));
  stage.metadata().integration_time = 2e-3;
  for (auto _ : state) stage.run();
}

void points(benchmark::State& state, const std::string& line) {
  tofgraph::Harness stage(line);
  std::vector<float> all;
  for (const float v : noisy(1.0F, 0.01F)) all.insert(all.end(), {v, -v, v + 1});
  stage.put<float>("points", {size, size, 3}, all);
  for (auto _ : state) stage.run();
}

BENCHMARK_CAPTURE(run, perpendicular_illumination, "perpendicular_illumination", "distance")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, simple_bistatic_given, "simple_bistatic plane_depth='1 m'", "distance")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, simple_bistatic_estimated, "simple_bistatic", "distance")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, offset_correction, "offset_correction calibration='" + calibration + "'", "distance")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, offset_correction_not_averaged, "offset_correction window=1 calibration='" + calibration + "'",
                  "distance")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, offset_correction_scattered, "offset_correction calibration='" + scattered_calibration() + "'",
                  "distance")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, offset_correction_scattered_everywhere,
                  "offset_correction window=1 calibration='" + scattered_calibration() + "'", "distance", 0.2F)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, mask, "mask min_amplitude='900 counts' max_sigma='20 mm'", "depth")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, crop_region, "crop columns=[10, 180] rows=[3, 190]", "depth")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, crop_range, "crop minimum='990 mm' minimum_amplitude='900 counts'", "depth")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, intrinsics_rectified, "intrinsics rectify=true k1=-0.3", "depth")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, average_of_10, "average frames=10", "depth")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, average_running_10, "average frames=10 running=true", "depth")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(points, transform, "transform angles=['1 deg', '2 deg', '3 deg']")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(points, voxel_grid, "voxel_grid size='20 mm'")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(points, statistical_outlier_removal, "statistical_outlier_removal")->Unit(benchmark::kMillisecond);

}  // namespace
