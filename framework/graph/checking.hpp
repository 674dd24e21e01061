// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Graphs that are built only for inspection: `check`, `explain`.
#pragma once

namespace tofgraph::graph {

/// Returns whether this process only checks graphs: stages are then told that the run is over before it begins.
bool only_checking();
void set_only_checking();

}  // namespace tofgraph::graph
