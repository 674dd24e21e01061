// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The denoisers on one core, compared with the closest OpenCV functions on the same image in the same run.
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/photo.hpp>
#include <tofgraph/harness.hpp>

#include "tests/unit/denoise_reference.hpp"

namespace {

/// The pallet of boxes with noise of 10 mm.
test::Image noisy_boxes(std::ptrdiff_t size) {
  test::Image depth = test::box_scene(size).depth;
  test::add_noise(depth, 0.010, 1);
  return depth;
}

void one_core() {
  static const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, 1);
  cv::setNumThreads(1);
}

/// Runs a stage on a frame with depth and flags. @param sigma adds the channels sigma and amplitude
void stage(benchmark::State& state, const std::string& line, bool sigma, std::ptrdiff_t size, bool invalid = false) {
  one_core();
  test::Image depth = noisy_boxes(size);
  if (invalid) test::drop_pixels(depth, 0.05, 2);
  const auto side = static_cast<std::uint64_t>(size);
  tofgraph::Harness stage(line);
  stage.put<float>("depth", {side, side}, depth.values);
  stage.put<std::uint16_t>("flags", {side, side}, std::vector<std::uint16_t>(depth.values.size(), 0));
  if (sigma) {
    stage.put<float>("sigma", {side, side}, std::vector<float>(depth.values.size(), 0.010F),
                     {.unit = "m", .of = "depth", .applied = "", .from = ""});
    stage.put<float>("amplitude", {side, side}, test::box_scene(size).amplitude.values);
    stage.metadata().modulation_frequency = 20e6;  // Hz
  }
  for (auto _ : state) stage.run();
}

void opencv_bilateral(benchmark::State& state) {
  one_core();
  test::Image depth = noisy_boxes(204);
  const cv::Mat image(204, 204, CV_32F, depth.values.data());
  cv::Mat filtered;
  for (auto _ : state) cv::bilateralFilter(image, filtered, 7, 0.020 / std::sqrt(2.0), 5 / std::sqrt(2.0));
}

/// 16 bit, unit 0.1 mm: float is not supported.
void opencv_non_local_means(benchmark::State& state) {
  one_core();
  test::Image depth = noisy_boxes(204);
  cv::Mat image, filtered;
  cv::Mat(204, 204, CV_32F, depth.values.data()).convertTo(image, CV_16U, 1e4);
  for (auto _ : state) cv::fastNlMeansDenoising(image, filtered, std::vector<float>{200}, 3, 7, cv::NORM_L1);
}

BENCHMARK(opencv_bilateral)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(stage, yaroslavsky, "yaroslavsky strength='20 mm'", false, 204)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(stage, bilateral, "bilateral strength='20 mm'", false, 204)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(stage, bilateral_sigma, "bilateral strength='20 mm'", true, 204)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(stage, non_local_means_sigma, "non_local_means strength='20 mm'", true, 204)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(stage, bilateral_4_megapixels, "bilateral strength='20 mm'", false, 2048)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(stage, non_local_means, "non_local_means strength='20 mm'", false, 204)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(stage, non_local_means_invalid, "non_local_means strength='20 mm'", false, 204, true)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(stage, non_local_means_patch_7, "non_local_means strength='20 mm' patch=7", false, 204)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(stage, non_local_means_uniform_3, "non_local_means strength='20 mm' patch_weights=uniform", false,
                  204)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(stage, non_local_means_uniform_7, "non_local_means strength='20 mm' patch_weights=uniform patch=7",
                  false, 204)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(stage, non_local_means_robust, "non_local_means strength='20 mm' patch_weights=robust", true, 204)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(stage, non_local_means_robust_guided,
                  "non_local_means strength='20 mm' patch_weights=robust guide=amplitude", true, 204)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(stage, non_local_means_4_megapixels, "non_local_means strength='20 mm'", false, 2048)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(opencv_non_local_means)->Unit(benchmark::kMillisecond);

}  // namespace
