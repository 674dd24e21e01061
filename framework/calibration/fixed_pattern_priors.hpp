// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Priors of the fixed-pattern fit: displacements of boards, and the magnitude of an error that depends on the
/// measured distance. All are standard deviations of normal distributions about zero. Those of the poses are
/// estimated from the data within bounds, so that no pose diverges along a direction that the data do not
/// determine.
#pragma once

#include "calibration/fixed_pattern.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace tofgraph::calibration::pattern {

/// Bounds of the poses' standard deviations: a board that is set up by hand on a rail is within centimetres, and a
/// curvature of 0.05 1/m corresponds to a wiggling of 9 mm at 20 MHz. The offset, by integration time or a wrong zero,
/// is not bounded in practice.
inline constexpr ViewPose min_jitter{1e-6, 1e-6, 1e-6, 1e-6, 1e-6};
inline constexpr ViewPose max_jitter{1, 20e-3, 20e-3, 20e-3, 50e-3};
/// The two starts of the estimate; both must converge to the same map.
inline constexpr ViewPose first_jitter{10e-3, 10e-3, 5e-3, 5e-3, 20e-3};
inline constexpr ViewPose second_jitter{0.5e-3, 0.5e-3, 0.2e-3, 0.2e-3, 1e-3};
/// Number of bounds beyond which a board is reported as not at its stated position.
inline constexpr double max_deviations = 4;

/// m. Bounds of the standard deviation of the board's shape, which is estimated like the jitter: a flat board does not
/// increase the uncertainty of the map.
inline constexpr double min_shape = 1e-6, max_shape = 5e-3;
/// m. Gauge: the displacements have the mean 0, because a common change of all boards' positions cannot be
/// distinguished from the map. The map's mean, a common change of all pixels, is moved to the offsets.
inline constexpr double gauge = 1e-7;

/// Distance-dependent error, common to all views: harmonics of the phase, with amplitudes in rad of phase.
/// The first is crosstalk, a constant phasor that turns faint light more than strong light: its amplitude is that at
/// the mean faintness. The second is unequal phase steps, the fourth and the eighth are wiggling.
struct Harmonic {
  double order, amplitude;
  bool grows_with_faintness = false;
};
inline constexpr std::array<Harmonic, 4> harmonics = {{{1, 4e-3, true}, {2, 4e-3}, {4, 8e-3}, {8, 2e-3}}};
/// Bounds of the factor of these amplitudes, which is estimated like the jitter: if the distances show no such error,
/// it does not increase the uncertainty of the map.
inline constexpr double min_wave_scale = 1e-3, max_wave_scale = 2;

/// Returns the amplitude in m of a wave; each harmonic has two waves.
inline double wave_amplitude(std::ptrdiff_t wave, double metres_per_radian) {
  return harmonics[static_cast<std::size_t>(wave / 2)].amplitude * metres_per_radian;
}

/// Sums over the unknowns that share a standard deviation: of their squares and variances, and their number.
struct SharedSums {
  double square = 0, variance = 0, count = 0;
};

/// Returns the next estimate of a standard deviation (MacKay, Neural Computation 4, 1992), within its bounds.
/// @param gradient raised to the derivative of the log marginal likelihood by the logarithm of the standard deviation,
/// divided by the number of unknowns, unless it points beyond a bound
inline double improved_sd(double sd, const std::array<double, 2>& bounds, const SharedSums& sums, double& gradient) {
  if (!(sums.count > 0)) return sd;
  const double known = sums.count - sums.variance / (sd * sd);
  const double slope = ((sums.square + sums.variance) / (sd * sd) - sums.count) / sums.count;
  if (!(slope > 0 ? sd >= bounds[1] : sd <= bounds[0])) gradient = std::max(gradient, std::abs(slope));
  return std::clamp(known > 1e-9 * sums.count ? std::sqrt(sums.square / known) : sd, bounds[0], bounds[1]);
}

}  // namespace tofgraph::calibration::pattern
