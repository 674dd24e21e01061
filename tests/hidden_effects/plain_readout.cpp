// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The samples and taps levels: exposures, two taps each, and the delivered counts.
#include "tests/hidden_effects/plain_camera.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace tofgraph::hidden {
namespace {

/// Motion of the board between two phase images, m.
double moved_per_image(const Physics& physics, const View& view) {
  const double displacement = physics.effects.value("motion", "displacement");
  if (std::isnan(view.velocity)) return displacement;
  return displacement * view.velocity / 0.1 +
         view.velocity / (static_cast<double>(physics.camera.steps.size()) * physics.camera.frame_rate);
}

/// Correlation of an exposure: a cosine, modified by the effects on the waveform.
class Waveform {
 public:
  explicit Waveform(const Physics& physics) {
    const Effects& e = physics.effects;
    even_ = e.value("even_harmonic", "ratio");
    steps_ = physics.camera.steps;
    for (std::size_t k = 1; k < std::min<std::size_t>(steps_.size(), 4); ++k)
      steps_[k] += e.value("phase_step_error", "step" + std::to_string(k));
    odd_ = {{{3, e.value("wiggling", "amplitude"), e.value("wiggling", "phase")},
             {5, e.value("wiggling", "amplitude5"), e.value("wiggling", "phase5")},
             {7, e.value("wiggling", "amplitude7"), e.value("wiggling", "phase7")}}};
    for (Harmonic& harmonic : odd_) harmonic.ratio /= physics.camera.metres_per_radian();
  }

  double sample(std::complex<double> phasor, std::size_t k) const {
    const double phase = std::arg(phasor) + steps_[k];
    double shape = std::cos(phase) + even_ * std::cos(2 * phase);
    for (const Harmonic& harmonic : odd_)
      if (harmonic.ratio != 0) shape += harmonic.ratio * std::cos(harmonic.order * phase + harmonic.phase);
    return std::abs(phasor) * shape;
  }

 private:
  struct Harmonic {
    double order, ratio, phase;
  };
  double even_ = 0;
  std::vector<double> steps_;  // rad, including their errors
  std::array<Harmonic, 3> odd_{};
};

double at(const Image& map, std::size_t i) { return map.empty() ? 0 : map[i]; }

/// Counts of a tap: its gain, the pixel's response and dark level.
struct Counting {
  const PixelMaps& maps;
  double scale, integration_time;

  double operator()(double tap, double gain, std::size_t i) const {
    return tap * gain * (1 + scale * at(maps.response, i)) +
           scale * (at(maps.dark, i) + at(maps.dark_rate, i) * integration_time);
  }
};

}  // namespace

Taps expected_taps(const Physics& physics, const View& view) {
  const Camera& camera = physics.camera;
  const Effects& e = physics.effects;
  const Waveform waveform(physics);
  const Counting counting{physics.maps, e.value("pixel_response", "scale"), view.integration_time};
  std::vector<double> gains(camera.steps.size(), 1);
  for (std::size_t k = 1; k < std::min<std::size_t>(gains.size(), 4); ++k)
    gains[k] += e.value("phase_gain", "gain" + std::to_string(k));
  const double mismatch = e.value("tap_mismatch", "ratio");
  const double room = view.ambient && !view.capped ? e.value("ambient_light", "rate") * view.integration_time / 2 : 0;
  const double threshold = e.value("ambient_light", "suppression");  // the common mode above it is removed
  const double step = moved_per_image(physics, view);
  Taps taps{std::vector<Image>(gains.size()), std::vector<Image>(gains.size())};
  SensorLight light = light_on_sensor(physics, view, 0);
  for (std::size_t k = 0; k < gains.size(); ++k) {
    if (k > 0 && step != 0) light = light_on_sensor(physics, view, static_cast<double>(k) * step);
    taps.a[k].resize(camera.pixels());
    taps.b[k].resize(camera.pixels());
    for (std::size_t i = 0; i < camera.pixels(); ++i) {
      const double c = gains[k] * waveform.sample(light.phasor[i], k);
      const double mean = std::min(gains[k] * light.total[i] / (2 * camera.contrast) + room, threshold);
      taps.a[k][i] = counting(mean + c / 2, 1 + mismatch / 2, i);
      taps.b[k][i] = counting(mean - c / 2, 1 - mismatch / 2, i);
    }
  }
  return taps;
}

Readout::Readout(const Physics& physics, NoiseKind kind)
    : kind_(kind),
      read_variance_(physics.camera.read_noise * physics.camera.read_noise),
      shot_noise_(physics.camera.shot_noise),
      factor_(physics.effects.value("temporal_noise", "factor")),
      quadratic_(physics.effects.value("adc_nonlinearity", "quadratic")),
      cubic_(physics.effects.value("adc_nonlinearity", "cubic")),
      full_scale_(physics.effects.value("adc_nonlinearity", "full_scale")),
      full_well_(physics.effects.value("saturation", "full_well")) {}

double Readout::operator()(double expected, std::mt19937_64& random) {
  double tap = expected;
  if (kind_ != NoiseKind::none) {
    // Student's t with 3 degrees of freedom has variance 3.
    const double draw = kind_ == NoiseKind::heavy ? heavy_(random) / std::sqrt(3.0) : normal_(random);
    tap += draw * factor_ * std::sqrt(read_variance_ + shot_noise_ * std::max(0.0, expected));
  }
  const double share = tap / full_scale_;
  tap -= full_scale_ * share * share * (quadratic_ + cubic_ * share);
  return std::min(tap, full_well_);
}

}  // namespace tofgraph::hidden
