// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Priors of the fit of a fixed pattern: how far boards may be out of place, and how large an error that follows
/// the measured distance may be. All are standard deviations of normal distributions about zero. Those of the poses are
/// estimated from the data within bounds, so that no pose can run away along a direction that the data do not
/// determine.
#pragma once

#include "calibration/fixed_pattern.hpp"

#include <algorithm>
#include <array>

namespace tofgraph::calibration::pattern {

/// Bounds of the poses' standard deviations: a board that is set up by hand on a rail stands within centimetres, and a
/// bending of 0.05 1/m is the curvature of a wiggling of 9 mm at 20 MHz.
inline constexpr ViewPose min_jitter{0, 1e-6, 1e-6, 1e-6, 1e-6};
inline constexpr ViewPose max_jitter{0, 20e-3, 20e-3, 20e-3, 50e-3};
/// The two starts of the estimate; both have to end at the same map.
inline constexpr ViewPose first_jitter{0, 10e-3, 5e-3, 5e-3, 20e-3};
inline constexpr ViewPose second_jitter{0, 0.5e-3, 0.2e-3, 0.2e-3, 1e-3};
/// A board this many bounds away is not where the campaign says.
inline constexpr double max_deviations = 4;

inline constexpr double loose_shape = 5e-3;  ///< m, of a board
inline constexpr double loose_offset = 1;    ///< m, of all pixels of a view against those of the first view
/// m. Gauge: the first view's offset is 0 and the displacements have the mean 0, because an offset of all pixels, and a
/// displacement of all boards, cannot be told from the map. The map's mean is taken out and given to the offsets.
inline constexpr double gauge = 1e-7;

/// An error that follows the distance, common to all views: harmonics of the phase, with amplitudes in rad of phase.
/// The fourth and the eighth are wiggling, the first and second crosstalk and unequal phase steps.
struct Harmonic {
  double order, amplitude;
};
inline constexpr std::array<Harmonic, 4> harmonics = {{{1, 4e-3}, {2, 4e-3}, {4, 8e-3}, {8, 2e-3}}};

}  // namespace tofgraph::calibration::pattern
