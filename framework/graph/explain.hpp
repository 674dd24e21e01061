// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Explanation of a checked graph, as text and as a drawing.
#pragma once

#include "graph/graph.hpp"

#include <string>

namespace tofgraph::graph {

/// Meaning of a channel: shape, unit, quantity, and what was applied to it.
std::string channel_text(const Channel& channel);

/// Node by node: what it reads, changes and makes, in which unit, with which parameters and files.
std::string explain(const Graph& graph);

/// The graph in the DOT language.
std::string dot(const Graph& graph);

}  // namespace tofgraph::graph
