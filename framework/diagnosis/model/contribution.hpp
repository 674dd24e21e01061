// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Contribution of one effect to an extended model, compared with the one that is fitted anew without it.
#pragma once

#include "diagnosis/model/scan.hpp"

#include <cstdint>
#include <string>

namespace tofgraph::diagnosis {

/// True if two models differ by no more than conditions do from one to the next, and beyond that by less than matters
/// anywhere: however sure that is, it tells nothing apart. @param limit of chi-square for the former
bool practically_equivalent(const Problem& problem, const State& one, const State& other, double limit);

/// The change that a piece makes at its values, and its derivatives there: what is scored against generic patterns.
/// @param with a state that has the piece @throws simulation::EffectError
std::vector<Column> signature(const Problem& problem, const State& without, const State& with, const ModelTerm& piece);

}  // namespace tofgraph::diagnosis
