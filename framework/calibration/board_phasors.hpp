// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Phasors of the boards of a campaign at a few image positions, for checking the campaign's entries: common to
/// calibration and diagnosis.
#pragma once

#include "io/condition.hpp"

#include <complex>
#include <functional>
#include <vector>

namespace tofgraph::calibration {

/// Phasors of each condition at the same image positions.
struct BoardPhasors {
  using Phasors = std::vector<std::complex<double>>;  ///< counts; one per position
  std::vector<io::Condition> conditions;
  std::vector<Phasors> measured;    ///< NaN: unknown; empty if all are unknown
  std::vector<char> has_amplitude;  ///< 0: the magnitudes of the condition are meaningless
  std::vector<Phasors> ideal;       ///< of an ideal camera, with the stated reflectivity, or the same for all
  std::function<Phasors(const io::Condition&)> ideal_of;  ///< the same for a modified condition
  double modulation_frequency = 0;                        ///< Hz
  double min_distance = 0;                                ///< m, of a board
  double max_amplitude = io::unknown;  ///< counts, saturation level; unknown: saturated pixels are already excluded
  std::vector<double> recorded_times;  ///< s, integration times stated by the captures; NaN: not recorded

  std::size_t size() const { return conditions.size(); }
};

}  // namespace tofgraph::calibration
