// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/frames.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace tofgraph::simulation {
namespace {

/// Distance as a float; 0 if rounding raises it to the range.
float below(double range, double distance) {
  const auto rounded = static_cast<float>(distance);
  return static_cast<double>(rounded) >= range ? 0.0F : rounded;
}

}  // namespace

Frames::Frames(const ForwardModel& model, const Tracer& tracer, const Acquisition& acquisition, const Pixels& pixels,
               const physics::TapNoise& noise, NoiseSeed seed, bool with_taps)
    : model_(model),
      pixels_(pixels),
      acquisition_(acquisition),
      seed_(seed),
      noisy_(noise.known()),
      from_taps_(with_taps || model.has_readout()),
      exposures_(physics::exposures_of(model.camera())) {
  Expectation expectation = model.expect(tracer, acquisition, pixels);
  hits_ = std::move(expectation.hits);
  const std::size_t n = pixels.size();
  mean_.assign(expectation.taps.begin(), expectation.taps.end());
  deviation_.assign(2 * exposures() * n, 0);
  if (noisy_) {
    const double read = noise.read_noise * noise.read_noise;
    for (std::size_t at = 0; at < deviation_.size(); ++at) {
      const double removed = expectation.removed.empty() ? 0 : expectation.removed[at / (2 * n) * n + at % n];
      const double light = std::max(expectation.taps[at] + removed, 0.0);
      deviation_[at] = static_cast<float>(expectation.noise_factor * std::sqrt(read + noise.shot_noise * light));
    }
  }
  if (from_taps_) return;
  sample_mean_.resize(exposures() * n);
  sample_deviation_.resize(exposures() * n);
  for (std::size_t k = 0; k < exposures(); ++k) {
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t a = 2 * k * n + i, b = a + n;
      sample_mean_[k * n + i] = static_cast<float>(expectation.taps[a] - expectation.taps[b]);
      sample_deviation_[k * n + i] = std::hypot(deviation_[a], deviation_[b]);
    }
  }
}

void Frames::draw(std::uint64_t frame, const std::vector<float>& mean, const std::vector<float>& deviation, bool second,
                  std::size_t plane, float* out) const {
  const std::size_t first = second ? pixels_.size() : 0;
  constexpr std::size_t at_once = 4;
  constexpr std::uint32_t block = 1U << 28U;  // stream offset between groups of four exposures
  for (std::size_t begin = 0; begin < exposures(); begin += at_once) {
    std::array<const float*, at_once> means{}, deviations{};
    std::array<float*, at_once> outs{};
    const std::size_t count = std::min(at_once, exposures() - begin);
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t at = first + (begin + k) * plane;
      means[k] = mean.data() + at;
      deviations[k] = deviation.data() + at;
      outs[k] = out + at;
    }
    const std::uint32_t stream =
        2 * seed_.condition + (second ? 1U : 0U) + static_cast<std::uint32_t>(begin / at_once) * block;
    add_noise({seed_.seed, frame, stream}, pixels_.size(), std::span(means.data(), count),
              std::span(deviations.data(), count), std::span(outs.data(), count));
  }
}

std::vector<float> Frames::read_out(std::uint64_t frame) const {
  std::vector<float> taps = mean_;
  if (noisy_) {
    draw(frame, mean_, deviation_, false, 2 * pixels_.size(), taps.data());
    draw(frame, mean_, deviation_, true, 2 * pixels_.size(), taps.data());
  }
  if (!model_.has_readout()) return taps;
  std::vector<double> exact(taps.begin(), taps.end());
  model_.read_out(acquisition_, pixels_, exact);
  std::ranges::copy(exact, taps.begin());
  return taps;
}

void Frames::taps(std::uint64_t frame, std::uint16_t* out) const {
  const std::vector<float> values = read_out(frame);
  std::ranges::transform(values, out, [](float value) {  // analogue-to-digital converter; NaN becomes 0
    // NOLINTNEXTLINE(bugprone-incorrect-roundings): positive, and several times faster than lround
    return value > 0 ? static_cast<std::uint16_t>(std::min(value, 65535.0F) + 0.5F) : std::uint16_t{0};
  });
}

void Frames::phases(std::uint64_t frame, float* out) const {
  const std::size_t n = pixels_.size();
  if (!from_taps_) {
    if (noisy_)
      draw(frame, sample_mean_, sample_deviation_, false, n, out);
    else
      std::ranges::copy(sample_mean_, out);
    return;
  }
  const std::vector<float> values = read_out(frame);
  for (std::size_t k = 0; k < exposures(); ++k) {
    for (std::size_t i = 0; i < n; ++i) out[k * n + i] = values[2 * k * n + i] - values[(2 * k + 1) * n + i];
  }
}

void Frames::distance(std::uint64_t frame, float* distance, float* amplitude) const {
  const std::size_t n = pixels_.size();
  std::vector<float> samples(exposures() * n);
  phases(frame, samples.data());
  if (!physics::are_the_four(exposures_)) return decode_any(samples, distance, amplitude);
  const double own = exposures_[0].frequency;
  const double scale = physics::metres_per_radian(own > 0 ? own : acquisition_.condition.modulation_frequency);
  for (std::size_t i = 0; i < n; ++i) {
    const physics::Decoded decoded =
        physics::decode({samples[i], samples[n + i], samples[2 * n + i], samples[3 * n + i]});
    distance[i] = below(scale * physics::two_pi, scale * decoded.phase);
    amplitude[i] = static_cast<float>(decoded.amplitude);
  }
}

void Frames::decode_any(const std::vector<float>& samples, float* distance, float* amplitude) const {
  const std::size_t n = pixels_.size();
  const physics::PhaseDecoding decoding(exposures_, acquisition_.condition.modulation_frequency);
  std::vector<double> pixel(exposures());
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < exposures(); ++k) pixel[k] = samples[k * n + i];
    const auto decoded = decoding(pixel);
    distance[i] = below(decoding.range(), decoded.distance);
    amplitude[i] = static_cast<float>(decoded.amplitude);
  }
}

}  // namespace tofgraph::simulation
