// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Result of a run: frames, drops, times, memory.
#pragma once

#include "graph/graph.hpp"

#include <nlohmann/json.hpp>

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

namespace tofgraph::graph {

/// Run times of one node, kept in logarithmic bins of 2 %.
class TimeHistogram {
 public:
  void add(double seconds);
  std::uint64_t count() const;
  double quantile(double fraction) const;  ///< s
  double maximum() const { return static_cast<double>(maximum_ns_.load()) * 1e-9; }

 private:
  std::vector<std::atomic<std::uint32_t>> bins_ = std::vector<std::atomic<std::uint32_t>>(1536);
  std::atomic<std::uint64_t> maximum_ns_{0};
};

struct NodeStatistics {
  std::string name, stage;
  std::uint64_t frames = 0;
  double median_s = 0, p99_s = 0, max_s = 0;
};

/// Result of a run.
struct RunResult {
  std::uint64_t frames = 0;   ///< completed
  std::uint64_t dropped = 0;  ///< at the output of the source
  double wall_s = 0;
  std::size_t in_flight = 0;  ///< maximum number of frames in flight behind the source's output
  std::size_t buffers_allocated = 0;
  bool interrupted = false;
  std::string error;                  ///< node, frame and reason; empty: none
  std::vector<std::string> warnings;  ///< about the whole run
  std::vector<NodeStatistics> nodes;
};

/// Returns the statistics of a run. An edge's capacity is the number of frames that can wait on it: at the source's
/// output that of the queue, elsewhere that of frames in flight. A dropped frame is counted on the source's first edge.
nlohmann::json statistics_json(const Graph& graph, const RunResult& result);

}  // namespace tofgraph::graph
