// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Check of an effect's contract: off changes nothing, and finite light stays finite.
#pragma once

#include "simulation/files/model.hpp"

#include <string>

namespace tofgraph::simulation {

/// Looks at a board with the effect at its off values, which must change no bit, and at its typical ones, which must
/// leave every tap a number. @returns what is wrong with the plugin, or nothing, also where it cannot be asked: it
/// refuses these values, or has no size
std::string defect_of(const graph::Plugin& effect, const tofgraph_camera& camera);

/// Checks every effect of a model if plugins are validated (graph::validating); violations are added to the
/// diagnostics.
void look_closely(const Model& model, const tofgraph_camera& camera, config::Diagnostics& diagnostics);

}  // namespace tofgraph::simulation
