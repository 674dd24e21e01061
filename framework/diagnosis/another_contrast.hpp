// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Whether the contrast is an unknown of a search: where the taps alone, before any effect, contradict the
/// profile.
#pragma once

#include "diagnosis/design.hpp"
#include "diagnosis/nuisances.hpp"
#include "diagnosis/part.hpp"

#include <algorithm>
#include <vector>

namespace tofgraph::diagnosis {

/// Whether amplitudes beside intensities show a contrast that is not the profile's: by more than 1 %, and much the same
/// in the brighter half of the conditions, where what adds to the intensity alone, as ambient light, is least.
bool shows_another_contrast(const Design& design, const std::vector<Observations>& data);

inline bool has_contrast(const Nuisances& nuisances) {
  return std::ranges::find(nuisances.sd, &Variances::contrast) != nuisances.sd.end();
}

/// Where the contrast is an unknown of a problem: puts the value that suits a fit of it in the place of the unknown of
/// conditions that were put aside. The contrast is the camera's, as effects are; were it fitted to these conditions
/// once more, with an effect and without, it would follow what else they have, as boards that are not flat.
void hold_contrast(FoldProblem& held, const Problem& fitted, const State& state);

}  // namespace tofgraph::diagnosis
