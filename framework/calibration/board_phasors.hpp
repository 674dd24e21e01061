// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Boards of a campaign as few phasors, for the check of what was written of them: common to calibration and
/// diagnosis.
#pragma once

#include "io/condition.hpp"

#include <complex>
#include <functional>
#include <vector>

namespace tofgraph::calibration {

/// Each condition at the same places of the image.
struct BoardPhasors {
  using Phasors = std::vector<std::complex<double>>;  ///< counts; one a place
  std::vector<io::Condition> conditions;
  std::vector<Phasors> measured;    ///< NaN: not known; a condition without any is empty
  std::vector<char> has_amplitude;  ///< 0: the magnitudes of the condition mean nothing
  std::vector<Phasors> ideal;       ///< an ideal camera's; the reflectivity is the stated one, or the same for all
  std::function<Phasors(const io::Condition&)> ideal_of;  ///< the same of a condition that was written otherwise
  double modulation_frequency = 0;                        ///< Hz
  double min_distance = 0;                                ///< m, of a board
  double max_amplitude = io::unknown;  ///< counts, where taps saturate; unknown: saturated pixels are left out already
  std::vector<double> recorded_times;  ///< s, integration times that the captures say; NaN: not recorded

  std::size_t size() const { return conditions.size(); }
};

}  // namespace tofgraph::calibration
