// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Conditions that contradict the rest of their campaign, because something was written wrongly: told before any
/// search, which would take them for what the simulation lacks. The check is calibration/plausibility.hpp.
#pragma once

#include "calibration/plausibility.hpp"
#include "diagnosis/data/ingest.hpp"

namespace tofgraph::diagnosis {

using calibration::Contradiction;

/// The boards' superpixels. @param measurements stays as long as the result
calibration::BoardPhasors phasors_of(const Measurements& measurements);

/// Those of calibration::contradictions. In the order of the conditions of the design.
std::vector<Contradiction> contradictions(const Measurements& measurements);

/// @throws config::ConfigurationError with every contradiction at its place in the campaign
void require_consistent(const Measurements& measurements);

}  // namespace tofgraph::diagnosis
