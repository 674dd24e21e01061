// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Every effect as a formula of an independently implemented camera.
#pragma once

#include <random>

#include "io/captures/capture_map.hpp"
#include "tests/program.hpp"
#include "tests/unit/effect_formulas.hpp"

namespace tofgraph::test {

struct Row {
  std::string effect, parameters;
  Formula formula;
};

/// Contents of the effects' maps, and their files.
struct Files {
  tests::TemporaryFolder folder;
  std::vector<double> offsets = numbers(1, 5e-3), slopes = numbers(2, 1e-3), gains = numbers(3, 0.02),
                      dark = numbers(4, 4), rate = numbers(5, 100);
  std::string maps = (folder.path() / "maps.h5").string(), table = (folder.path() / "table.csv").string();

  Files() {
    io::write_pixel_maps(maps,
                         {{"offsets", "m", offsets},
                          {"slopes", "", slopes},
                          {"gains", "", gains},
                          {"dark", "counts", dark},
                          {"rate", "counts/s", rate}},
                         204, 204);
    tests::write_text(table, "0.5,1\n8,5\n1,3\n");
  }
  std::string map(const std::string& name) const { return "{file: " + maps + ", dataset: " + name + "}"; }
  static std::vector<double> numbers(unsigned seed, double size) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0, size);
    std::vector<double> values(std::size_t{204} * 204);
    for (double& value : values) value = normal(random);
    return values;
  }
};

inline std::vector<Row> geometry_rows() {
  return {
      {"source_position",
       "separation: 4 mm, shift: 3 mm, depth: -2 mm",
       {.world =
            [](World& w) {
              for (Vector3& source : w.sources) {
                source.x += (source.x > 0 ? 0.004 : -0.004) + 0.003;
                source.z -= 0.002;
              }
            }}},
      {"lens_distortion",
       "k1: -0.1, k2: 0.02, p1: 0.001, p2: -0.002, k3: 0.01",
       {.world =
            [](World& w) {
              w.distortion = {-0.1, 0.02, 0.001, -0.002, 0.01};
            }}},
      {"principal_point",
       "x: 1.5 px, y: -2 px",
       {.world =
            [](World& w) {
              w.centre_x += 1.5;
              w.centre_y -= 2;
            }}},
      {"board_tilt",
       "x: 5 mrad, y: -3 mrad",
       {.world =
            [](World& w) {
              w.tilt_x = 5e-3;
              w.tilt_y = -3e-3;
            }}},
      {"rail_scale", "scale: 0.2 %", {.world = [](World& w) { w.scale = 1.002; }}},
      {"rail_offset", "offset: 5 mm", {.world = [](World& w) { w.offset = 5e-3; }}},
      {"motion", "displacement: 2 mm", {.displacement = 2e-3}},
  };
}

inline std::vector<Row> beam_rows() {
  return {
      {"source_amplitude", "ratio: 20 %", {.beam = [](Beam& b) { b.scale(1 + 0.1 * b.side()); }}},
      {"source_phase", "difference: 100 mrad", {.beam = [](Beam& b) { b.phasor *= std::polar(1.0, 0.05 * b.side()); }}},
      {"beam_profile",
       "exponent: 3, toe: 5 deg",
       {.beam =
            [](Beam& b) {
              const Vector3 axis{b.side() * std::sin(5 * degrees), 0, std::cos(5 * degrees)};
              b.scale(std::pow(-physics::dot(axis, b.to_source()), 3));
            }}},
      {"vignetting", "exponent: 4", {.beam = [](Beam& b) { b.scale(std::pow(b.spot.ray.z, 4)); }}},
      {"surface_reflectance",
       "lambert: 0.7, roughness: 0.4 rad",
       {.beam =
            [](Beam& b) {
              const double rough = oren_nayar(b, 0.4), cosine = physics::dot(b.to_source(), b.spot.normal);
              b.scale(b.world.physical ? rough : 0.3 + 0.7 * cosine * rough);
            }}},
      {"specular",
       "strength: 0.3, exponent: 40",
       {.beam =
            [](Beam& b) {
              const Vector3 half = b.to_source() - b.spot.ray;
              const double along = physics::dot(half, b.spot.normal) / physics::norm(half);
              b.scale(1 + 0.3 / b.spot.reflectivity * std::pow(along, 40));
            }}},
      {"multipath",
       "strength: 5 %, extra_path: 0.8 m",
       {.beam =
            [](Beam& b) {
              b.phasor += 0.05 * std::polar(b.strength, b.wave(b.path + b.spot.back + 0.8));
              b.strength *= 1.05;
            }}},
      {"rail_reflection",
       "strength: 4 %, height: 300 mm",
       {.beam =
            [](Beam& b) {
              const Vector3 image{b.source.x, 0.6 - b.source.y, b.source.z};
              b.phasor += 0.04 * std::polar(b.strength, b.wave(physics::norm(b.spot.at - image) + b.spot.back));
              b.strength *= 1.04;
            }}},
      {"warm_up",
       "drift: 10 mm, time_constant: 700 s, droop: 3 %",
       {.beam = [](Beam& b) { b.scale(1 - 0.03 * warm(700)); },
        .turn = [](const Light& l) { return l.radians(10e-3 * warm(700)); }}},
      {"stray_light",
       "fraction: 4 %, width: 30 px, uniform: 0.4",
       {.weights =
            [](std::size_t i) {
              double norm = 0;  // over an infinite line
              for (int j = -200; j <= 200; ++j) norm += std::exp(-j * j / (2 * std::pow(30 / spacing, 2)));
              std::vector<double> weights = gaussian(i, 30);
              for (double& w : weights) w = 0.04 * (0.6 * w / (norm * norm) + 0.4 / pixels);
              weights[i] += 1;
              return weights;
            }}},
      {"mixed_pixels",
       "blur: 20 px",
       {.weights =
            [](std::size_t i) {
              std::vector<double> weights = gaussian(i, 20);
              double sum = 0;
              for (const double w : weights) sum += w;
              for (double& w : weights) w /= sum;
              return weights;
            }}},
      {"crosstalk", "real: 3000 counts/s, imaginary: -2000 counts/s", {.inside = {6, -4}}},  // in 2 ms
      {"static_reflection", "strength: 3000 counts/s, distance: 0 mm", {.inside = {6, 0}}},
  };
}

inline std::vector<Row> phase_rows(const Files& files) {
  return {
      {"amplitude_walk",
       "logarithmic: 8 mrad, inverse: 3 mrad",
       {.turn = [](const Light& l) { return 8e-3 * std::log(l.amplitude / 1000) + 3e-3 * 1000 / l.amplitude; }}},
      {"modulation_frequency",
       "error: 500 ppm",
       {.turn = [](const Light& l) { return 500e-6 * l.radians(l.distance); }}},
      {"integration_time_offset",
       "slope: 8 mm, linear: 3 m/s",
       {.turn = [](const Light& l) { return l.radians(8e-3 * std::log(2.0) + 3 * 1e-3); }}},
      {"integration_time_offset",
       "slope: 8 mm, exponent: 0.5",
       {.turn = [](const Light& l) { return l.radians(8e-3 * (std::sqrt(2.0) - 1) / 0.5); }}},
      {"zero_offset", "offset: 20 mm", {.turn = [](const Light& l) { return l.radians(20e-3); }}},
      {"integration_time_offset",
       "table: " + files.table,  // 2 ms: a third of the way from 1 to 8 in the logarithm
       {.turn = [](const Light& l) { return l.radians(3e-3 + 2e-3 / 3); }}},
      {"fixed_pattern",
       "scale: 2, map: " + files.map("offsets") + ", slope_map: " + files.map("slopes"),
       {.turn =
            [&files](const Light& l) {
              return 2 *
                     l.radians(from_map(files.offsets, l.u, l.v) + from_map(files.slopes, l.u, l.v) * (l.distance - 2));
            }}},
  };
}

/// Light and reference that are on from -window/2 to window/2, correlated numerically (Gauss-Legendre with eight points
/// in each quarter of a period), equation (5.54); relative to an unlimited window.
inline double correlate_windows(double phase, double lag, double window, double frequency) {
  constexpr double nodes[][2] = {{0.1834346424956498, 0.3626837833783620},
                                 {0.5255324099163290, 0.3137066458778873},
                                 {0.7966664774136267, 0.2223810344533745},
                                 {0.9602898564975363, 0.1012285362903763}};
  const double begin = std::max(-window / 2, -window / 2 - lag), end = std::min(window / 2, window / 2 - lag);
  const double w = 2 * pi * frequency, quarters = std::ceil((end - begin) * frequency * 4);
  const double half = (end - begin) / quarters / 2;
  double sum = 0;
  for (double quarter = 0; quarter < quarters; ++quarter) {
    const double middle = begin + (2 * quarter + 1) * half;
    for (const auto& [node, weight] : nodes) {
      for (const double t : {middle - half * node, middle + half * node})
        sum += weight * half * std::cos(w * t) * std::cos(w * t + phase);
    }
  }
  return end > begin ? 2 / window * sum : 0;
}

inline std::vector<Row> sample_rows() {
  return {
      {"finite_integration",
       "window: 250 ns, on_time_shift: 40 ns",
       {.sample =
            [](Sample& s) {
              const double lag = 2 * s.distance / c_light + s.step / (2 * pi * s.frequency);
              s.c = 210.0 / 250 * s.amplitude * correlate_windows(s.phase + s.step, lag, 210e-9, s.frequency);
            }}},
      {"wiggling",
       "amplitude: 9 mm, phase: 0.7 rad, amplitude5: 4 mm, phase5: -1.1 rad, amplitude7: -3 mm, phase7: 0.3 rad",
       {.sample =
            [](Sample& s) {
              const double m = 4 * pi * s.frequency / c_light * 1e-3 * s.amplitude, angle = s.phase + s.step;
              s.c +=
                  m * (9 * std::cos(3 * angle + 0.7) + 4 * std::cos(5 * angle - 1.1) - 3 * std::cos(7 * angle + 0.3));
            }}},
      {"even_harmonic",
       "ratio: 0.03",
       {.sample = [](Sample& s) { s.c += 0.03 * s.amplitude * std::cos(2 * (s.phase + s.step)); }}},
      {"phase_step_error",
       "step1: 10 mrad, step2: -4 mrad, step3: 7 mrad",
       {.sample =
            [](Sample& s) {
              const double errors[] = {0, 0.010, -0.004, 0.007};
              s.c = s.amplitude * std::cos(s.phase + s.step + (s.k < 4 ? errors[s.k] : 0));
            }}},
      {"phase_gain",
       "gain1: 1 %, gain2: -0.5 %, gain3: 0.25 %",
       {.sample =
            [](Sample& s) {
              const double gains[] = {1, 1.01, 0.995, 1.0025}, gain = s.k < 4 ? gains[s.k] : 1;
              s.c *= gain;
              s.intensity *= gain;
            }}},
  };
}

inline std::vector<Row> tap_rows(const Files& files) {
  return {
      {"tap_mismatch",
       "ratio: 4 %",
       {.taps =
            [](Taps& t) {
              t.a *= 1.02;
              t.b *= 0.98;
            }}},
      {"ambient_light",
       "rate: 2e5 counts/s",
       {.taps =
            [](Taps& t) {
              t.a += 200;
              t.b += 200;
            }}},
      {"ambient_light",
       "rate: 2e5 counts/s, suppression: 1000 counts",
       {.taps =
            [](Taps& t) {
              const double mean = (t.a + t.b) / 2 + 200, kept = std::min(mean, 1000.0), c = t.a - t.b;
              t.a = kept + c / 2;
              t.b = kept - c / 2;
            }}},
      {"pixel_response",
       "scale: 1, map: " + files.map("gains") + ", dark_map: " + files.map("dark") +
           ", dark_rate_map: " + files.map("rate"),
       {.taps =
            [&files](Taps& t) {
              const double dark = from_map(files.dark, t.u, t.v) + from_map(files.rate, t.u, t.v) * integration_time;
              for (double* tap : {&t.a, &t.b}) *tap = *tap * (1 + from_map(files.gains, t.u, t.v)) + dark;
            }}},
      {"adc_nonlinearity",
       "quadratic: 4 %, cubic: 3 %",
       {.taps =
            [](Taps& t) {
              for (double* tap : {&t.a, &t.b}) *tap -= 0.04 * *tap * *tap / 30000 + 0.03 * std::pow(*tap, 3) / 9e8;
            }}},
      {"saturation",
       "full_well: 1000 counts",
       {.taps =
            [](Taps& t) {
              t.a = std::min(t.a, 1000.0);
              t.b = std::min(t.b, 1000.0);
            }}},
      {"temporal_noise", "factor: 2.5", {.noise = 2.5}},
  };
}

inline std::vector<Row> all_rows(const Files& files) {
  std::vector<Row> all;
  for (const auto& part : {geometry_rows(), beam_rows(), phase_rows(files), sample_rows(), tap_rows(files)})
    all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace tofgraph::test
