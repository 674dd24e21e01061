// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Sets of effects on which folds agree and which the model of all data lacks.
#pragma once

#include "diagnosis/search/crossfit.hpp"

#include <vector>

namespace tofgraph::diagnosis {

/// Models of folds that have an effect which more than half of the folds chose and a model lacks, each with another set
/// of effects, the set that most folds chose first. Empty where fewer than three folds were searched.
/// @param given terms of the model before the search
std::vector<State> agreed_models(const CrossFit& folds, const State& model, std::size_t given);

}  // namespace tofgraph::diagnosis
