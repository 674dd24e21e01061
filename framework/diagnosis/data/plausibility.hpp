// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Conditions that contradict the rest of their campaign because of wrong entries: reported before any search, which
/// would mistake them for missing effects. The check itself is calibration/plausibility.hpp.
#pragma once

#include "calibration/plausibility.hpp"
#include "diagnosis/data/ingest.hpp"

namespace tofgraph::diagnosis {

using calibration::Contradiction;

/// Phasors of the boards' superpixels. @param measurements must outlive the result
calibration::BoardPhasors phasors_of(const Measurements& measurements);

/// Result of calibration::contradictions, in the order of the design's conditions.
std::vector<Contradiction> contradictions(const Measurements& measurements);

/// @throws config::ConfigurationError with every contradiction and its position in the campaign
void require_consistent(const Measurements& measurements);

}  // namespace tofgraph::diagnosis
