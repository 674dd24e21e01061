// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Decision whether a search estimates the contrast: it does if the taps alone contradict the profile.
#pragma once

#include "diagnosis/design.hpp"
#include "diagnosis/nuisances.hpp"
#include "diagnosis/part.hpp"

#include <algorithm>
#include <vector>

namespace tofgraph::diagnosis {

/// True if the ratio of amplitude to intensity shows a contrast that differs from the profile's by more than 1 %,
/// consistently over the brighter half of the conditions, where ambient light matters least.
bool shows_another_contrast(const Design& design, const std::vector<Observations>& data);

inline bool has_contrast(const Nuisances& nuisances) {
  return std::ranges::find(nuisances.sd, &Variances::contrast) != nuisances.sd.end();
}

/// Fixes the contrast of held-out conditions at the value of a fit that estimated it. Fitted to the held-out conditions
/// again, it would absorb other errors in them, such as boards that are not flat.
void hold_contrast(FoldProblem& held, const Problem& fitted, const State& state);

}  // namespace tofgraph::diagnosis
