// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/segments.hpp"

namespace tofgraph::graph {

std::vector<Segment> segments_of(const Graph& graph, const std::function<bool(const Node&)>& has_receiver) {
  std::vector<Segment> segments;
  // Only the receiver needs the frames in order: a node without state still works on several of them at once.
  const auto receive = [&](std::size_t i) {
    if (!has_receiver(*graph.nodes()[i])) return;
    if (segments.empty() || !segments.back().ordered) segments.push_back({.ordered = true});
    segments.back().received = i;
  };
  receive(0);  // the source runs in a thread of its own
  for (std::size_t i = 1; i < graph.nodes().size(); ++i) {
    const Node& node = *graph.nodes()[i];
    const bool ordered = !node.stateless();
    if (segments.empty() || ordered || segments.back().ordered) segments.push_back({.ordered = ordered});
    segments.back().nodes.push_back(i);
    receive(i);
  }
  if (segments.empty()) segments.emplace_back();
  return segments;
}

}  // namespace tofgraph::graph
