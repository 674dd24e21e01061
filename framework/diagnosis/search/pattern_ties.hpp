// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Effects of the set-up that a map of the pixels would take in unseen.
#pragma once

#include "diagnosis/model/fit.hpp"

#include <memory>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// "These conditions cannot distinguish board_tilt from the map of fixed_pattern: ..", for each effect of the set-up
/// that the author of a map in the model lists as confused with it, and of which the data say less than its typical
/// size beside the map. @param candidates effects that the model may lack
std::vector<std::string> notes_on_pattern_ties(const Problem& problem, const ModelFit& fit,
                                               const std::vector<std::unique_ptr<Candidate>>& candidates);

}  // namespace tofgraph::diagnosis
