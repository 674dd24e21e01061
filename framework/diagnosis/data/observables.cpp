// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/data/observables.hpp"

#include <cmath>
#include <numeric>
#include <stdexcept>

namespace tofgraph::diagnosis {

Demodulation::Demodulation(const physics::Exposures& exposures) {
  if (const std::string problem = physics::exposures_problem(exposures); !problem.empty())
    throw std::invalid_argument(problem);
  if (const std::string problem = physics::not_one_frequency(exposures); !problem.empty())
    throw std::invalid_argument("a search " + problem);
  const physics::PhaseFit fit = physics::phase_fits(exposures).front();
  cosine_ = fit.cosine;
  sine_ = fit.sine;
  xx_ = fit.xx;
  xy_ = fit.xy;
  yy_ = fit.yy;
  const std::size_t n = exposures.size();
  const auto count = static_cast<double>(n);
  double cosine = 0, sine = 0;
  for (const tofgraph_exposure& exposure : exposures) {
    cosine += std::cos(exposure.phase) / count;
    sine += std::sin(exposure.phase) / count;
  }
  for (std::size_t k = 0; k < n; ++k) offset_.push_back(1 / count - cosine * cosine_[k] + sine * sine_[k]);
  // Weights that are zero except for rounding would turn noise into values.
  for (auto* weights : {&cosine_, &sine_, &offset_}) {
    for (double& weight : *weights) weight = std::abs(weight) < 1e-14 ? 0 : weight;
  }
  null1_variance_ = std::inner_product(offset_.begin(), offset_.end(), offset_.begin(), 0.0);
  if (fit.rest.empty()) return;
  rest_ = fit.rest.front();
  for (double& weight : rest_) weight /= std::sqrt(count);
}

Signal Demodulation::of_samples(std::span<const double> samples, double intensity) const {
  Signal signal{{}, intensity};
  double x = 0, y = 0;
  for (std::size_t k = 0; k < exposures(); ++k) {
    x += cosine_[k] * samples[k];
    y += sine_[k] * samples[k];
    signal.null1 += offset_[k] * samples[k];
    if (has_null2()) signal.null2 += rest_[k] * samples[k];
  }
  signal.phasor = {x, y};
  return signal;
}

Signal Demodulation::of_taps(const double* taps, std::size_t stride) const {
  std::array<double, physics::max_exposures> samples{};
  double sum = 0;
  for (std::size_t k = 0; k < exposures(); ++k) {
    const double a = taps[2 * k * stride], b = taps[(2 * k + 1) * stride];
    samples[k] = a - b;
    sum += a + b;
  }
  return of_samples({samples.data(), exposures()}, sum / (2 * static_cast<double>(exposures())));
}

Demodulation::Variance Demodulation::variance(std::complex<double> phasor) const {
  const double length = std::abs(phasor), c = length > 0 ? phasor.real() / length : 1,
               s = length > 0 ? phasor.imag() / length : 0;
  return {xx_ * c * c + 2 * xy_ * c * s + yy_ * s * s, xx_ * s * s - 2 * xy_ * c * s + yy_ * c * c};
}

}  // namespace tofgraph::diagnosis
