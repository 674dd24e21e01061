// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Which nodes run as one task.
#pragma once

#include "graph/graph.hpp"

#include <functional>
#include <string>
#include <vector>

namespace tofgraph::graph {

/// Consecutive nodes that run as one task. A node that keeps state is alone, behind a sequencer.
struct Segment {
  bool ordered = false;
  std::vector<std::size_t> nodes;  ///< empty: nothing reads the source
};

/// The segments of a graph, at least one. @param in_order says of a node that its frames must come in order although
/// it keeps no state
std::vector<Segment> segments_of(const Graph& graph, const std::function<bool(const Node&)>& in_order);

}  // namespace tofgraph::graph
