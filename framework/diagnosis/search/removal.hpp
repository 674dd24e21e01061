// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Fits without one addition, and lower limits of the deviance that it costs.
#pragma once

#include "diagnosis/model/fit.hpp"

#include <span>
#include <vector>

namespace tofgraph::diagnosis {

/// Model without an addition. The derivatives are those of the model with it. @throws simulation::EffectError
ModelFit fit_without(const Problem& problem, const ModelFit& best, const ModelTerm& addition);

/// Lower limits of the rise of the deviance when each of some additions is removed: from the linearised part of its
/// change that no other effect and no map can make, if boards and light take over as much as they can. 0 if unknown:
/// for additions with maps, and if the other effects fail without the addition.
std::vector<double> min_deviance_rises(const Problem& problem, const ModelFit& best,
                                       std::span<const ModelTerm> additions);

}  // namespace tofgraph::diagnosis
