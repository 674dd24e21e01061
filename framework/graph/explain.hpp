// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Explanation of a checked graph, as text and as a diagram.
#pragma once

#include "graph/graph.hpp"

#include <string>

namespace tofgraph::graph {

/// Describes a channel: shape, unit, quantity and applied corrections.
std::string channel_text(const Channel& channel);

/// Describes each node: channels read, changed and made, with units, parameters and files.
std::string explain(const Graph& graph);

/// Returns the graph in the DOT language.
std::string dot(const Graph& graph);

}  // namespace tofgraph::graph
