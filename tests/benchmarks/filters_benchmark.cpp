// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The measuring chain of a CamCube, 204 x 204 pixels on one core, stage by stage through the plugin interface.
#include "tests/unit/cameras.hpp"

#include <benchmark/benchmark.h>
#include <tofgraph/harness.hpp>
#include <tofgraph/physics/exposures.hpp>
#include <tofgraph/physics/four_phase.hpp>
#include <tofgraph/physics/geometry.hpp>
#include <tofgraph/physics/phasor.hpp>

using namespace tofgraph;

namespace {

constexpr std::size_t pixels = std::size_t{204} * 204;

/// From 0.3 to 7.3 m over the image.
double depth_at(std::size_t pixel) { return 0.3 + 7.0 * static_cast<double>(pixel) / pixels; }

const test::Camera& camera() {
  static const test::Camera it = test::camcube2();
  return it;
}

std::vector<float> phases() {
  const auto geometry = physics::geometry_of(camera().view);
  const physics::Exposure exposure{7e6, 0.5, 1e-3, 20e6};
  std::vector<float> values(4 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto ray = physics::unit_ray(&camera().rays[3 * i]);
    const auto light =
        physics::reference_light(geometry, ray, physics::reflected_path(geometry, ray, depth_at(i)), 0.85, exposure);
    const auto c = physics::samples_of(light.phasor);
    for (std::size_t k = 0; k < 4; ++k) values[k * pixels + i] = static_cast<float>(c[k]);
  }
  return values;
}

void decoder(benchmark::State& state) {
  Harness stage("four_phase_decoder");
  stage.camera(test::profile_of(camera().view));
  stage.metadata().modulation_frequency = 20e6;
  stage.put<float>("phases", {4, 204, 204}, phases());
  for (auto _ : state) stage.run();
}
BENCHMARK(decoder)->Unit(benchmark::kMicrosecond);

void decoder_taps(benchmark::State& state) {
  Harness stage("four_phase_decoder");
  stage.camera(test::profile_of(camera().view));
  stage.metadata().modulation_frequency = 20e6;
  const std::vector<float> c = phases();
  std::vector<std::uint16_t> taps(8 * pixels);
  for (std::size_t k = 0; k < 4; ++k) {
    for (std::size_t i = 0; i < pixels; ++i) {
      taps[(2 * k) * pixels + i] = static_cast<std::uint16_t>(15000 + c[k * pixels + i] / 2);
      taps[(2 * k + 1) * pixels + i] = static_cast<std::uint16_t>(15000 - c[k * pixels + i] / 2);
    }
  }
  stage.put<std::uint16_t>("taps", {4, 2, 204, 204}, taps);
  for (auto _ : state) stage.run();
}
BENCHMARK(decoder_taps)->Unit(benchmark::kMicrosecond);

/// Nine images of 640 x 480 pixels at 80, 16 and 120 MHz: every wrap of 18.7 m.
constexpr std::size_t vga_rows = 480, vga_columns = 640;
physics::Exposures nine_images() {
  physics::Exposures exposures;
  for (const double frequency : {80e6, 16e6, 120e6})
    for (int k = 0; k < 3; ++k) exposures.push_back({k * physics::two_pi / 3, frequency});
  return exposures;
}
template <class T> std::vector<T> nine_phases() {
  std::vector<T> values;
  for (const auto& [phase, frequency] : nine_images()) {
    for (std::size_t i = 0; i < vga_rows * vga_columns; ++i) {
      const double distance = 0.3 + 18.0 * static_cast<double>(i) / (vga_rows * vga_columns);
      values.push_back(static_cast<T>(1000 * std::cos(distance / physics::metres_per_radian(frequency) + phase)));
    }
  }
  return values;
}

template <class T> void phase_decoder_nine_images(benchmark::State& state) {
  const physics::Exposures exposures = nine_images();
  test::Camera vga(vga_columns, vga_rows, 5.6e-3, 10e-6, {{"lamp", {0, 0, 0}, 1}});
  vga.view.modulation_frequency = exposures[0].frequency;
  vga.view.exposures = exposures.data();
  vga.view.exposure_size = sizeof(tofgraph_exposure);
  vga.view.exposure_count = exposures.size();
  Harness stage("phase_decoder");
  stage.camera(test::profile_of(vga.view));
  stage.put<T>("phases", {9, vga_rows, vga_columns}, nine_phases<T>());
  for (auto _ : state) stage.run();
  state.counters["frames/s"] = benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(phase_decoder_nine_images<float>)->Unit(benchmark::kMillisecond);
BENCHMARK(phase_decoder_nine_images<std::int16_t>)->Unit(benchmark::kMillisecond);

/// The same formulas pixel by pixel in plain float, arrays on the stack: a typical hand-written version.
void scalar_nine_images(benchmark::State& state) {
  const std::vector<float> phases = nine_phases<float>();
  constexpr std::size_t n = vga_rows * vga_columns;
  const float scales[] = {static_cast<float>(physics::metres_per_radian(16e6)),
                          static_cast<float>(physics::metres_per_radian(80e6)),
                          static_cast<float>(physics::metres_per_radian(120e6))};
  const std::size_t first[] = {3, 0, 6};
  std::vector<float> distance(n), amplitude(n);
  for (auto _ : state) {
    for (std::size_t i = 0; i < n; ++i) {
      float wrapped[3], weight[3], range[3], sum = 0, mean = 0;
      for (int b = 0; b < 3; ++b) {
        const float *c = &phases[first[b] * n + i], c0 = c[0], c1 = c[n], c2 = c[2 * n];
        const float x = (2 * c0 - c1 - c2) / 3, y = (c2 - c1) / 1.7320508F, square = x * x + y * y;
        range[b] = 6.2831853F * scales[b];
        wrapped[b] = scales[b] * std::atan2(y, x);
        if (wrapped[b] < 0) wrapped[b] += range[b];
        weight[b] = square / (scales[b] * scales[b]);
        sum += weight[b];
        mean += std::sqrt(square) / 3;
      }
      float best = 1e30F;
      for (int wrap = 0; wrap < 15; ++wrap) {
        const float reference = wrapped[2] + static_cast<float>(wrap) * range[2];
        float shift = 0, square = 0;
        for (int b = 0; b < 2; ++b) {
          const float away = wrapped[b] - reference, rest = away - range[b] * std::nearbyint(away / range[b]);
          shift += weight[b] * rest;
          square += weight[b] * rest * rest;
        }
        const float cost = square - shift * shift / sum;
        if (cost < best) {
          best = cost;
          distance[i] = reference + shift / sum;
        }
      }
      amplitude[i] = mean;
    }
    benchmark::DoNotOptimize(distance.data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(scalar_nine_images)->Unit(benchmark::kMillisecond);

/// The decoding formula of libfreenect2 (Kinect v2), hand-written: unwrapping by rounded differences of the phases in
/// the units 1/3, 1/15 and 1/2 of the common range, and their distance from the line of equal distances as confidence.
void libfreenect2_formula(benchmark::State& state) {
  const std::vector<float> phases = nine_phases<float>();
  constexpr std::size_t n = vga_rows * vga_columns;
  constexpr float waves[] = {3, 15, 2}, two_pi = 6.2831853F;       // 80, 16, 120 MHz
  const auto metres = static_cast<float>(299792458.0 / 2 / 72e6);  // one period of the mean frequency
  std::vector<float> distance(n), amplitude(n);
  float worst = 0;
  for (auto _ : state) {
    for (std::size_t i = 0; i < n; ++i) {
      float t[3], light = 0;
      for (std::size_t b = 0; b < 3; ++b) {
        const float* c = &phases[3 * b * n + i];
        const float x = (2 * c[0] - c[n] - c[2 * n]) / 3, y = (c[2 * n] - c[n]) / 1.7320508F;
        float psi = std::atan2(y, x);
        if (psi < 0) psi += two_pi;
        t[b] = psi / two_pi * waves[b];
        light += std::sqrt(x * x + y * y) / 3;
      }
      float first = std::floor((t[1] - t[0]) / 3 + 0.5F) * 3 + t[0], second = t[1];
      const float apart = first - t[2], half = std::abs(apart) / 2, part = 2 * (half - std::floor(half));
      if (part > 0.5F && part < 1.5F) {  // the third indicates that the range was exceeded once
        first += 15;
        second += 15;
      }
      const float third = (std::floor((first - t[2]) / 2 + 0.5F) * 2 + t[2]) / 2;
      first /= 3;
      second /= 15;
      const float u = two_pi * (third * 0.551318F - first * 0.826977F),
                  v = two_pi * (first * 0.110264F - second * 0.551318F),
                  w = two_pi * (second * 0.826977F - third * 0.110264F);
      const float mean = (first + second + third) / 3;
      distance[i] = u * u + v * v + w * w < 1 && mean > 0 ? metres * mean : 0;
      amplitude[i] = light;
    }
    benchmark::DoNotOptimize(distance.data());
    benchmark::ClobberMemory();
  }
  for (std::size_t i = 0; i < n; ++i)
    worst = std::max(worst, std::abs(distance[i] - 0.3F - 18 * static_cast<float>(i) / n));
  if (!(worst < 1e-3F)) state.SkipWithError("a decoded distance is off by more than 1 mm");
}
BENCHMARK(libfreenect2_formula)->Unit(benchmark::kMillisecond);

std::vector<float> distances() {
  const auto geometry = physics::geometry_of(camera().view);
  std::vector<float> values(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    values[i] =
        static_cast<float>(physics::distance_at_depth(geometry, physics::unit_ray(&camera().rays[3 * i]), depth_at(i)));
  }
  return values;
}

void optimized_bistatic(benchmark::State& state, const char* line, bool with_sigma) {
  Harness stage(line);
  stage.camera(test::profile_of(camera().view));
  stage.put<float>("distance", {204, 204}, distances());
  stage.put<std::uint16_t>("flags", {204, 204}, std::vector<std::uint16_t>(pixels));
  if (with_sigma) stage.put<float>("sigma", {204, 204}, std::vector<float>(pixels, 2e-3F), {.of = "distance"});
  for (auto _ : state) stage.run();
}
BENCHMARK_CAPTURE(optimized_bistatic, two_sources, "optimized_bistatic", false)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(optimized_bistatic, two_sources_sigma, "optimized_bistatic", true)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(optimized_bistatic, reference, "optimized_bistatic solver=bisection", false)
    ->Unit(benchmark::kMicrosecond);

/// Method of the thesis: D_ref by bisection of 0 .. 7.5 m for each pixel, plain scalar code; stops at a micrometre.
void scalar_bisection(benchmark::State& state) {
  const std::vector<float> measured = distances();
  const auto geometry = physics::geometry_of(camera().view);
  std::vector<physics::Vector3> rays(pixels);
  for (std::size_t i = 0; i < pixels; ++i) rays[i] = physics::unit_ray(&camera().rays[3 * i]);
  std::vector<float> depth(pixels);
  for (auto _ : state) {
    for (std::size_t i = 0; i < pixels; ++i) {
      double low = 0, high = 7.5;
      while (high - low > 1e-6) {
        const double middle = (low + high) / 2;
        const physics::Vector3 p = geometry.lens_centre() + middle * rays[i];
        const double yz = p.y * p.y + p.z * p.z;
        const double left = std::sqrt((p.x + 0.05) * (p.x + 0.05) + yz),
                     right = std::sqrt((p.x - 0.05) * (p.x - 0.05) + yz);
        const double path = (left + right) / 2 + middle + geometry.focal_length / rays[i].z;
        (path < 2 * static_cast<double>(measured[i]) ? low : high) = middle;
      }
      depth[i] = static_cast<float>(geometry.focal_length + low * rays[i].z);
    }
    benchmark::DoNotOptimize(depth.data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(scalar_bisection)->Unit(benchmark::kMicrosecond);

void point_cloud(benchmark::State& state) {
  Harness stage("point_cloud");
  stage.camera(test::profile_of(camera().view));
  std::vector<float> depth(pixels);
  for (std::size_t i = 0; i < pixels; ++i) depth[i] = static_cast<float>(depth_at(i));
  stage.put<float>("depth", {204, 204}, depth);
  stage.put<std::uint16_t>("flags", {204, 204}, std::vector<std::uint16_t>(pixels));
  for (auto _ : state) stage.run();
}
BENCHMARK(point_cloud)->Unit(benchmark::kMicrosecond);

void simulator(benchmark::State& state, const char* line) {
  Harness stage(line);
  stage.camera(test::profile_of(camera().view));
  for (auto _ : state) stage.run();
}
BENCHMARK_CAPTURE(simulator, without_noise, "simulator frames=0 noise=none")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(simulator, with_noise, "simulator frames=0")->Unit(benchmark::kMicrosecond);

}  // namespace
