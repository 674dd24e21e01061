// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Constants and quantities that depend on the modulation frequency alone.
#pragma once

#include <numbers>

namespace tofgraph::physics {

inline constexpr double speed_of_light = 299792458.0;  ///< m/s, in vacuum
inline constexpr double two_pi = 2 * std::numbers::pi;

/// Metres of (half-path) distance for one radian of phase: D = metres_per_radian * Psi, equation (2.4).
/// @param modulation_frequency Hz
constexpr double metres_per_radian(double modulation_frequency) {
  return speed_of_light / (2 * two_pi * modulation_frequency);
}

/// Unambiguous range in metres, c / (2 f_mod): the phase wraps to 0 there.
/// @param modulation_frequency Hz
constexpr double unambiguous_range(double modulation_frequency) { return speed_of_light / (2 * modulation_frequency); }

}  // namespace tofgraph::physics
