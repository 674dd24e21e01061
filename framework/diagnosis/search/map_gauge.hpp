// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The mean of a map of lengths and a constant offset are one and the same: which of both has it is declared.
#pragma once

#include "diagnosis/model/fit.hpp"

namespace tofgraph::diagnosis {

/// A state in which the constant has all of it, where the model has one: estimated maps of lengths then have no mean
/// over the pixels. It expects the same as before. @throws simulation::EffectError
State with_means_in_constant(const Problem& problem, State state);

}  // namespace tofgraph::diagnosis
