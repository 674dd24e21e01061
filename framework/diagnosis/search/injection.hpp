// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Campaigns of which the truth is known: what a model expects, with noise like that of the data.
#pragma once

#include "diagnosis/model/fit.hpp"

#include <cstdint>

namespace tofgraph::diagnosis {

/// Observations of the problem's own conditions and masks under another state: its effects, reflectivities, and
/// normal noise of the data's variances; jitter of board, camera and light, a wander, sessions and a residue of the
/// state's standard deviations; the boards as they are. A residue is new in each condition, whatever the data's
/// stays for. @throws simulation::EffectError
std::vector<Observations> injected(const Problem& problem, const State& state, std::uint64_t seed);

/// A term with each size at a factor of its typical value, of random sign where both are allowed, and shapes about
/// theirs (angles anywhere).
Term random_term(const Candidate& candidate, double factor, std::uint64_t seed);

}  // namespace tofgraph::diagnosis
