// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Graphs that are built to be looked at: `check`, `explain`.
#pragma once

namespace tofgraph::graph {

/// Returns whether the graphs of this process are only checked: for their stages the run is over before it begins.
bool only_checking();
void set_only_checking();

}  // namespace tofgraph::graph
