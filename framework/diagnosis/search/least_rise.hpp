// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Lower limits of the deviance that a model loses without a term, before it is fitted without it.
#pragma once

#include "diagnosis/search/trials.hpp"

#include <span>
#include <vector>

namespace tofgraph::diagnosis {

/// Least rises of the deviance where each of some pieces is taken out of a model: what its change of the data makes
/// that no other effect and no map can make, linearised, if boards and light take over as much as they can. 0 where
/// that is not known: of pieces with maps, and of those without which others give no number.
std::vector<double> min_deviance_rises(const Problem& problem, const ModelFit& best, std::span<const ModelTerm> pieces);

}  // namespace tofgraph::diagnosis
