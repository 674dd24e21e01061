// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Sample and tap level: four exposures, and what the taps hold of them.
#include "simulation/evaluation.hpp"

#include <cmath>
#include <numbers>

namespace tofgraph::simulation {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// e^(j angle) * p, exactly for whole quarter turns from k pi/2.
Complex turned(Complex p, double angle, std::size_t k) {
  if (angle == static_cast<double>(k) * (std::numbers::pi / 2)) {
    constexpr std::array<Complex, 4> quarters = {Complex{1, 0}, Complex{0, 1}, Complex{-1, 0}, Complex{0, -1}};
    const Complex q = quarters[k];
    return {p.real() * q.real() - p.imag() * q.imag(), p.real() * q.imag() + p.imag() * q.real()};
  }
  return p * std::polar(1.0, angle);
}

}  // namespace

Expectation Evaluation::develop() {
  const std::size_t n = pixels_.size();
  for (std::size_t k = 0; k < 4; ++k) {
    exposures_.insert(exposures_.end(), light_.begin(), light_.end());
    intensities_.insert(intensities_.end(), strength_.begin(), strength_.end());
  }
  extras_.assign(4 * n, 0);
  exposure = reinterpret_cast<double*>(exposures_.data());
  intensity = intensities_.data();
  extra = extras_.data();
  displace = [](tofgraph_light_state* state, std::uint32_t k, double displacement) {
    return static_cast<Evaluation*>(state)->move_exposure(k, displacement);
  };
  if (shot_.moving) {
    for (std::size_t k = 1; k < 4; ++k) {
      changes_[k].time = static_cast<double>(k) / (4 * camera->frame_rate);
      shine_again(k);
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

void Evaluation::shine_again(std::size_t k) {
  Evaluation other(model_, tracer_, shot_, pixels_, changes_[k]);
  other.shine();
  const std::size_t n = pixels_.size();
  if (clean_[k].empty()) {
    clean_[k] = light_;
    clean_strength_[k] = strength_;
  }
  for (std::size_t i = 0; i < n; ++i) {
    Complex& now = exposures_[k * n + i];
    now = clean_[k][i] != Complex{} ? now * (other.light_[i] / clean_[k][i]) : other.light_[i];
    double& amount = intensities_[k * n + i];
    amount = clean_strength_[k][i] > 0 ? amount * (other.strength_[i] / clean_strength_[k][i]) : other.strength_[i];
  }
  clean_[k] = std::move(other.light_);
  clean_strength_[k] = std::move(other.strength_);
}

int Evaluation::move_exposure(std::uint32_t k, double displacement) noexcept {
  if (k > 3) return TOFGRAPH_STATUS_ERROR;
  if (displacement == 0) return TOFGRAPH_STATUS_OK;
  try {
    changes_[k].displacement += displacement;
    shine_again(k);
    return TOFGRAPH_STATUS_OK;
  } catch (const std::exception&) {
    return TOFGRAPH_STATUS_ERROR;
  }
}

void Evaluation::expose(Expectation& result) {
  const std::size_t n = pixels_.size();
  result.taps.resize(8 * n);
  for (std::size_t k = 0; k < 4; ++k) {
    for (std::size_t i = 0; i < n; ++i) {
      double c = turned(exposures_[k * n + i], steps_[k].phase, k).real() + extras_[k * n + i];
      if (std::isnan(pixels_.rays[i].z)) c = nan;
      const double mean = intensities_[k * n + i];
      result.taps[2 * k * n + i] = mean + c / 2;
      result.taps[(2 * k + 1) * n + i] = mean - c / 2;
    }
  }
  taps = result.taps.data();
  for (std::size_t e = 0; e < model_.first_readout(); ++e) {
    if (model_.effects()[e]->level() == TOFGRAPH_LEVEL_TAPS) model_.effects()[e]->apply(*this);
  }
  if (model_.has_readout()) {  // one after the readout may still set the noise
    std::vector<double> copy = result.taps;
    taps = copy.data();
    for (std::size_t e = model_.first_readout(); e < model_.effects().size(); ++e) model_.effects()[e]->apply(*this);
  }
  result.noise_factor = noise_factor;
}

}  // namespace tofgraph::simulation
