// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Graphs that are built only for inspection: `check`, `explain`.
#pragma once

namespace tofgraph::graph {

/// Returns whether this process only checks graphs; for their stages stopping() is then true from the start.
bool only_checking();
void set_only_checking();

}  // namespace tofgraph::graph
