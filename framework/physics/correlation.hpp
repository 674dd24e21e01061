// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Correlation of light and reference signals of finite duration: section 5.2 of the reference.
#pragma once

#include <tofgraph/physics/constants.hpp>

#include <cmath>

namespace tofgraph::physics {

/// Correlation of two cosines of one frequency, each gated by a window of length T, equation (5.54) relative to the
/// amplitude of unlimited cosines: envelope cos(w lag) + ripple.
struct WindowedCorrelation {
  double envelope = 0;  ///< 1 - |lag|/T, the triangle (5.57) normalised to 1; 0 if the windows do not overlap
  double ripple = 0;    ///< sin(w (T - |lag|)) / (w T). Printed (5.56) integrates from -d to d; the windows' overlap is
                        ///< centred at -lag/2, which makes this term independent of cos(w lag)
};

/// @param lag s, delay between the two windows
/// @param window s, on-time T of both, > 0
/// @param frequency modulation frequency, Hz
inline WindowedCorrelation windowed_correlation(double lag, double window, double frequency) {
  const double overlap = window - std::abs(lag), angular = two_pi * frequency;
  if (overlap <= 0) return {};
  return {overlap / window, std::sin(angular * overlap) / (angular * window)};
}

}  // namespace tofgraph::physics
