// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/data/pixel_phases.hpp"

#include "diagnosis/data/search_settings.hpp"

#include <cmath>

namespace tofgraph::diagnosis {

void PixelPhases::add(std::size_t pixel, std::complex<double> seen, std::complex<double> expected, double variance) {
  sum_[pixel] += seen * std::conj(expected) / variance;
  information_[pixel] += std::norm(expected) / variance;
  ++seen_[pixel];
}

PixelPhases& PixelPhases::operator+=(const PixelPhases& other) {
  for (std::size_t p = 0; p < other.sum_.size(); ++p) {
    sum_[p] += other.sum_[p];
    information_[p] += other.information_[p];
    seen_[p] += other.seen_[p];
  }
  return *this;
}

bool PixelPhases::stand_out() const {
  double beyond = 0, conditions = 0;
  for (std::size_t p = 0; p < sum_.size(); ++p) {
    if (seen_[p] < 2) continue;
    beyond += sum_[p].imag() * sum_[p].imag() / information_[p] - 1;
    conditions += seen_[p];
  }
  return beyond > settings.pixel_phase_excess * conditions;
}

std::complex<double> PixelPhases::aligned(std::size_t pixel, std::complex<double> phasor) const {
  const double length = std::abs(sum_[pixel]);
  return length > 0 ? phasor * std::conj(sum_[pixel]) / length : phasor;
}

}  // namespace tofgraph::diagnosis
