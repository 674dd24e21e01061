// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Sample and tap level: the exposures and the resulting taps.
#include "simulation/evaluation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace tofgraph::simulation {
namespace {

/// e^(j angle), exact for multiples of pi/2 despite their rounding.
Complex turn_of(double angle) {
  constexpr std::array<Complex, 4> quarters = {Complex{1, 0}, Complex{0, 1}, Complex{-1, 0}, Complex{0, -1}};
  for (std::size_t k = 0; k < quarters.size(); ++k)
    if (angle == static_cast<double>(k) * (std::numbers::pi / 2)) return quarters[k];
  return std::polar(1.0, angle);
}

}  // namespace

Expectation Evaluation::integrate() {
  const std::size_t n = pixels_.size(), count = steps_.size();
  for (const double each : frequencies_) illuminate_at(each);
  for (const double each : frequencies_) {
    const Illumination& illuminate = by_frequency_.at(each);
    exposures_.insert(exposures_.end(), illuminate.light.begin(), illuminate.light.end());
    intensities_.insert(intensities_.end(), illuminate.strength.begin(), illuminate.strength.end());
  }
  clean_.resize(count);
  changes_.assign(count, moved_);
  extras_.assign(count * n, 0);
  exposure = reinterpret_cast<double*>(exposures_.data());
  intensity = intensities_.data();
  extra = extras_.data();
  displace = [](tofgraph_light_state* state, std::uint32_t k, double displacement) {
    return static_cast<Evaluation*>(state)->move_exposure(k, displacement);
  };
  if (acquisition_.moving) {
    for (std::size_t k = 1; k < count; ++k) {
      changes_[k].time = static_cast<double>(k) / (static_cast<double>(count) * camera->frame_rate);
      reilluminate(k);
    }
  }
  apply_level(TOFGRAPH_LEVEL_SAMPLES);
  Expectation result;
  expose(result);
  result.hits = std::move(hits_);
  return result;
}

void Evaluation::use_taps(std::span<double> values) {
  points = pixels_.size();
  taps = values.data();
  pixel = pixels_.at.data();
}

void Evaluation::illuminate_at(double other_frequency) {
  if (by_frequency_.contains(other_frequency)) return;
  if (other_frequency == frequency) {
    by_frequency_[frequency] = {light_, strength_};
    return;
  }
  Evaluation other(model_, tracer_, acquisition_, pixels_, moved_, other_frequency);
  other.illuminate();
  by_frequency_[other_frequency] = {std::move(other.light_), std::move(other.strength_)};
}

void Evaluation::reilluminate(std::size_t k) {
  Evaluation other(model_, tracer_, acquisition_, pixels_, changes_[k], frequencies_[k]);
  other.illuminate();
  const std::size_t n = pixels_.size();
  Illumination& clean = clean_[k];
  if (clean.light.empty()) clean = by_frequency_.at(frequencies_[k]);
  for (std::size_t i = 0; i < n; ++i) {
    Complex& now = exposures_[k * n + i];
    now = clean.light[i] != Complex{} ? now * (other.light_[i] / clean.light[i]) : other.light_[i];
    double& amount = intensities_[k * n + i];
    amount = clean.strength[i] > 0 ? amount * (other.strength_[i] / clean.strength[i]) : other.strength_[i];
  }
  clean = {std::move(other.light_), std::move(other.strength_)};
}

int Evaluation::move_exposure(std::uint32_t k, double displacement) noexcept {
  if (k >= steps_.size()) return TOFGRAPH_STATUS_ERROR;
  if (displacement == 0) return TOFGRAPH_STATUS_OK;
  try {
    changes_[k].displacement += displacement;
    reilluminate(k);
    return TOFGRAPH_STATUS_OK;
  } catch (const std::exception&) {
    return TOFGRAPH_STATUS_ERROR;
  }
}

void Evaluation::expose(Expectation& result) {
  const std::size_t n = pixels_.size();
  result.taps.resize(2 * steps_.size() * n);
  for (std::size_t k = 0; k < steps_.size(); ++k) {
    const Complex turn = turn_of(steps_[k].phase);
    for (std::size_t i = 0; i < n; ++i) {
      const Complex p = exposures_[k * n + i];
      double c = p.real() * turn.real() - p.imag() * turn.imag() + extras_[k * n + i];
      if (std::isnan(pixels_.rays[i].z)) c = io::unknown;
      const double mean = intensities_[k * n + i];
      result.taps[2 * k * n + i] = mean + c / 2;
      result.taps[(2 * k + 1) * n + i] = mean - c / 2;
    }
  }
  taps = result.taps.data();
  std::vector<double> removed_counts;
  for (std::size_t e = 0; e < model_.first_readout(); ++e) {
    if (model_.effects()[e]->level() != TOFGRAPH_LEVEL_TAPS) continue;
    removed_counts.resize(steps_.size() * n);
    removed = removed_counts.data();
    model_.effects()[e]->apply(*this);
  }
  removed = nullptr;
  if (std::ranges::any_of(removed_counts, [](double counts) { return counts != 0; }))
    result.removed = std::move(removed_counts);
  if (model_.has_readout()) {  // readout effects may still set the noise
    std::vector<double> copy = result.taps;
    taps = copy.data();
    for (std::size_t e = model_.first_readout(); e < model_.effects().size(); ++e) model_.effects()[e]->apply(*this);
  }
  result.noise_factor = noise_factor;
}

}  // namespace tofgraph::simulation
