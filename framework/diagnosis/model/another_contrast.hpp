// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Decision whether a search estimates the contrast: it does if the taps alone contradict the profile.
#pragma once

#include "diagnosis/data/design.hpp"
#include "diagnosis/model/linearisation.hpp"
#include "diagnosis/model/nuisances.hpp"

#include <algorithm>
#include <vector>

namespace tofgraph::diagnosis {

/// True if the ratio of amplitude to intensity shows a contrast that differs from the profile's by more than 1 %,
/// consistently over the brighter half of the conditions, where ambient light matters least.
bool shows_another_contrast(const Design& design, const std::vector<Observations>& data);

inline bool has_contrast(const Nuisances& nuisances) {
  return std::ranges::find(nuisances.sd, &RandomEffectSd::contrast) != nuisances.sd.end();
}

/// ln of how much lower than the profile's the contrast is, if it is an unknown of a problem.
double log_lower_contrast(const Problem& problem, const State& state);

}  // namespace tofgraph::diagnosis
