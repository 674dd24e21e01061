// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The samples and taps levels: four exposures, two taps each, and what is handed out of them.
#include "tests/hidden_effects/plain_camera.hpp"

#include <algorithm>
#include <cmath>

namespace tofgraph::hidden {
namespace {

/// How far the board moves between two phase images, m.
double moved_per_image(const Physics& physics, const View& view) {
  const double displacement = physics.effects.value("motion", "displacement");
  if (std::isnan(view.velocity)) return displacement;
  return displacement * view.velocity / 0.1 + view.velocity / (4 * physics.camera.frame_rate);
}

/// The correlation of one exposure: a cosine, or what the effects on the waveform make of it.
double sample(const Effects& e, std::complex<double> phasor, std::size_t k, double metres_per_radian) {
  static const std::array<const char*, 4> steps = {"", "step1", "step2", "step3"};
  double phase = std::arg(phasor) + static_cast<double>(k) * M_PI / 2;
  if (k > 0) phase += e.value("phase_step_error", steps[k]);
  double shape = std::cos(phase) + e.value("even_harmonic", "ratio") * std::cos(2 * phase);
  if (e.has("wiggling"))
    for (const auto& [harmonic, length, angle] :
         {std::tuple{3, "amplitude", "phase"}, {5, "amplitude5", "phase5"}, {7, "amplitude7", "phase7"}})
      shape +=
          e.value("wiggling", length) / metres_per_radian * std::cos(harmonic * phase + e.value("wiggling", angle));
  return std::abs(phasor) * shape;
}

double exposure_gain(const Effects& e, std::size_t k) {
  static const std::array<const char*, 4> gains = {"", "gain1", "gain2", "gain3"};
  return k == 0 ? 1 : 1 + e.value("phase_gain", gains[k]);
}

double at(const Image& map, std::size_t i) { return map.empty() ? 0 : map[i]; }

/// One tap: light of the room, its gain, the pixel's response and dark level.
double counted(const Physics& physics, const View& view, double tap, double gain, std::size_t i) {
  const double scale = physics.effects.value("pixel_response", "scale");
  const PixelMaps& maps = physics.maps;
  tap *= gain * (1 + scale * at(maps.response, i));
  return tap + scale * (at(maps.dark, i) + at(maps.dark_rate, i) * view.integration_time);
}

}  // namespace

Taps expected_taps(const Physics& physics, const View& view) {
  const Camera& camera = physics.camera;
  const Effects& e = physics.effects;
  const double step = moved_per_image(physics, view);
  const double mismatch = e.value("tap_mismatch", "ratio");
  const double room = view.ambient && !view.capped ? e.value("ambient_light", "rate") * view.integration_time / 2 : 0;
  const double threshold = e.value("ambient_light", "suppression");
  Taps taps;
  SensorLight light = light_on_sensor(physics, view, 0);
  for (std::size_t k = 0; k < 4; ++k) {
    if (k > 0 && step != 0) light = light_on_sensor(physics, view, static_cast<double>(k) * step);
    taps.a[k].resize(camera.pixels());
    taps.b[k].resize(camera.pixels());
    const double gain = exposure_gain(e, k);
    for (std::size_t i = 0; i < camera.pixels(); ++i) {
      const double c = gain * sample(e, light.phasor[i], k, camera.metres_per_radian());
      double mean = gain * light.total[i] / (2 * camera.contrast) + room;
      mean = std::min(mean, threshold);  // the common mode above it is taken away
      taps.a[k][i] = counted(physics, view, mean + c / 2, 1 + mismatch / 2, i);
      taps.b[k][i] = counted(physics, view, mean - c / 2, 1 - mismatch / 2, i);
    }
  }
  return taps;
}

double Readout::operator()(double expected, std::mt19937_64& random) {
  const Camera& camera = physics_.camera;
  const Effects& e = physics_.effects;
  double tap = expected;
  if (kind_ != NoiseKind::none) {
    const double variance = camera.read_noise * camera.read_noise + camera.shot_noise * std::max(0.0, expected);
    // Student's t with 3 degrees of freedom has variance 3.
    const double draw = kind_ == NoiseKind::heavy ? heavy_(random) / std::sqrt(3.0) : normal_(random);
    tap += draw * std::sqrt(variance) * e.value("temporal_noise", "factor");
  }
  if (e.has("adc_nonlinearity")) {
    const double full = e.value("adc_nonlinearity", "full_scale"), x = tap / full;
    tap -= full * x * x * (e.value("adc_nonlinearity", "quadratic") + e.value("adc_nonlinearity", "cubic") * x);
  }
  return std::min(tap, e.value("saturation", "full_well"));
}

}  // namespace tofgraph::hidden
