// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Grouping of nodes into tasks.
#pragma once

#include "graph/graph.hpp"

#include <functional>
#include <optional>
#include <vector>

namespace tofgraph::graph {

/// Consecutive nodes that run as one task. A node with state is a task of its own, behind a sequencer.
struct Segment {
  bool ordered = false;
  std::vector<std::size_t> nodes;       ///< may be empty
  std::optional<std::size_t> received;  ///< node whose frame is then passed to its receiver
};

/// Segments of a graph, at least one. @param has_receiver returns whether a node's frames are received, in order
std::vector<Segment> segments_of(const Graph& graph, const std::function<bool(const Node&)>& has_receiver);

}  // namespace tofgraph::graph
