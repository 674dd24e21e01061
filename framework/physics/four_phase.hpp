// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Four-phase sampling and decoding in double, and its noise: the reference implementation. The vectorised decode() is
/// in `vector_phase.hpp`.
#pragma once

#include <tofgraph/physics/constants.hpp>
#include <tofgraph/physics/phasor.hpp>

#include <array>
#include <cmath>
#include <complex>

namespace tofgraph::physics {

/// c_k = amplitude cos(Psi + k pi/2), k = 0..3: samples of an ideal camera, equation (5.61) without offset.
inline std::array<double, 4> samples_of(std::complex<double> phasor) {
  return {phasor.real(), -phasor.imag(), -phasor.real(), phasor.imag()};
}

/// Result of decoding four samples.
struct Decoded {
  double phase = 0;      ///< Psi, rad, 0 <= Psi < 2 pi
  double amplitude = 0;  ///< counts
  double null1 = 0;      ///< N1 = Gamma, counts: mean of the samples
  double null2 = 0;      ///< N2 = (c0 - c1 + c2 - c3)/4, counts: 0 for a sinusoid at exact steps
};

/// Decodes by equations (2.3), (2.5), (2.6), (5.62) over the full circle.
inline Decoded decode(const std::array<double, 4>& c) {
  const double sine = c[3] - c[1], cosine = c[0] - c[2];
  double phase = std::atan2(sine, cosine);
  if (phase < 0) phase += two_pi;
  if (phase >= two_pi) phase = 0;  // a tiny negative angle rounds up to 2 pi
  return {phase, std::hypot(sine, cosine) / 2, (c[0] + c[1] + c[2] + c[3]) / 4, (c[0] - c[1] + c[2] - c[3]) / 4};
}

/// Noise of one tap: variance = read_noise^2 + shot_noise * counts.
struct TapNoise {
  double read_noise = std::numeric_limits<double>::quiet_NaN();  ///< counts, standard deviation
  double shot_noise = std::numeric_limits<double>::quiet_NaN();  ///< counts: variance per count

  bool known() const { return std::isfinite(read_noise) && std::isfinite(shot_noise); }

  /// Variance of a sample c_k = A_k - B_k, counts^2.
  /// @param intensity mean of the two taps, counts
  double sample_variance(double intensity) const { return 2 * read_noise * read_noise + 2 * shot_noise * intensity; }
};

/// Standard deviation of D in metres if every sample has this variance: c / (4 pi f) s / (sqrt(2) amplitude).
inline double distance_sigma(double sample_variance, double amplitude, double modulation_frequency) {
  return metres_per_radian(modulation_frequency) * std::sqrt(sample_variance / 2) / amplitude;
}

}  // namespace tofgraph::physics
