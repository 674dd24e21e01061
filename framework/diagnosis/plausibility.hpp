// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Conditions that contradict the rest of their campaign, because something was written wrongly: told before any
/// search, which would take them for what the simulation lacks.
#pragma once

#include "diagnosis/ingest.hpp"

namespace tofgraph::diagnosis {

/// What was written of one condition, and what its data say.
struct Contradiction {
  enum class Kind { distance, target, integration_time, swapped };
  Kind kind = Kind::distance;
  std::size_t condition = 0;  ///< of the design
  std::string text;           ///< "you wrote 'distance: 10 m', the data say 1 m"
};

/// Compares the median distance and amplitude of each condition with what a robust fit of all others expects there:
/// an offset, what goes with ln amplitude and ln integration time, a constant phasor beside the light, one reflectivity
/// a target. A condition is named where it is far off and where one changed entry explains both its distance and its
/// amplitude. In the order of the conditions.
std::vector<Contradiction> contradictions(const Measurements& measurements);

/// @throws config::ConfigurationError with every contradiction at its place in the campaign
void require_consistent(const Measurements& measurements);

}  // namespace tofgraph::diagnosis
