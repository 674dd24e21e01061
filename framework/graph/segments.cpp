// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/segments.hpp"

namespace tofgraph::graph {

std::vector<Segment> segments_of(const Graph& graph, const std::function<bool(const Node&)>& in_order) {
  std::vector<Segment> segments;
  // The source runs in a thread of its own; its node here only delivers its frames to the observer in order.
  if (in_order(*graph.nodes().front())) segments.push_back({true, {0}});
  for (std::size_t i = 1; i < graph.nodes().size(); ++i) {
    const Node& node = *graph.nodes()[i];
    const bool ordered = !node.stateless() || in_order(node);
    if (segments.empty() || ordered || segments.back().ordered) segments.push_back({ordered, {}});
    segments.back().nodes.push_back(i);
  }
  if (segments.empty()) segments.emplace_back();
  return segments;
}

}  // namespace tofgraph::graph
