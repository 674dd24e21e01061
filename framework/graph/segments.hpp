// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Grouping of nodes into tasks.
#pragma once

#include "graph/graph.hpp"

#include <functional>
#include <string>
#include <vector>

namespace tofgraph::graph {

/// Consecutive nodes that run as one task. A node with state is a task of its own, behind a sequencer.
struct Segment {
  bool ordered = false;
  std::vector<std::size_t> nodes;  ///< empty: nothing reads the source
};

/// Segments of a graph, at least one. @param in_order returns whether a node needs its frames in order although it has
/// no state
std::vector<Segment> segments_of(const Graph& graph, const std::function<bool(const Node&)>& in_order);

}  // namespace tofgraph::graph
