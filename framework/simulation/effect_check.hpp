// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Check of an effect's contract: its off values change nothing, and finite light stays finite.
#pragma once

#include "simulation/files/model.hpp"

#include <string>

namespace tofgraph::simulation {

/// Simulates a board with the effect at its off values, which must not change any bit, and at its typical values,
/// which must keep every tap finite. @returns the violation; empty: none, or the effect cannot be tested because it
/// rejects these values or has no off value
std::string defect_of(const graph::Plugin& effect, const tofgraph_camera& camera);

/// Checks every effect of a model if plugins are validated (graph::validating); violations are added to the
/// diagnostics.
void validate_effects(const Model& model, const tofgraph_camera& camera, config::Diagnostics& diagnostics);

}  // namespace tofgraph::simulation
