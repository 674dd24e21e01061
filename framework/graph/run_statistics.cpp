// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/run_statistics.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace tofgraph::graph {

void TimeHistogram::add(double seconds) {
  const double nanoseconds = std::max(seconds * 1e9, 1.0);
  const auto bin = std::min(static_cast<std::size_t>(std::log(nanoseconds) / std::log(1.02)), bins_.size() - 1);
  bins_[bin].fetch_add(1, std::memory_order_relaxed);
  const auto whole = static_cast<std::uint64_t>(nanoseconds);
  for (std::uint64_t seen = maximum_ns_.load(); whole > seen && !maximum_ns_.compare_exchange_weak(seen, whole);) {
  }
}

std::uint64_t TimeHistogram::count() const {
  std::uint64_t total = 0;
  for (const auto& bin : bins_) total += bin.load();
  return total;
}

double TimeHistogram::quantile(double fraction) const {
  const auto wanted = static_cast<std::uint64_t>(std::ceil(fraction * static_cast<double>(count())));
  std::uint64_t seen = 0;
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    seen += bins_[i].load();
    if (seen >= wanted && seen > 0) return std::min(std::pow(1.02, static_cast<double>(i) + 0.5) * 1e-9, maximum());
  }
  return 0;
}

nlohmann::json statistics_json(const Graph& graph, const RunResult& result) {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  nlohmann::json nodes = nlohmann::json::array();
  for (const NodeStatistics& n : result.nodes) {
    nodes.push_back({{"name", n.name},
                     {"stage", n.stage},
                     {"frames", n.frames},
                     {"median_s", n.median_s},
                     {"p99_s", n.p99_s},
                     {"max_s", n.max_s}});
  }
  nlohmann::json edges = nlohmann::json::array();
  std::uint64_t dropped = result.dropped;
  for (std::size_t i = 0; i < graph.nodes().size(); ++i) {
    for (const std::size_t input : graph.inputs(i)) {
      const bool exit = graph.nodes()[input]->is_source();  // the only place where frames wait or are dropped
      edges.push_back({{"from", graph.nodes()[input]->name},
                       {"to", graph.nodes()[i]->name},
                       {"capacity", exit ? graph.queue().capacity : result.in_flight},
                       {"policy", exit && graph.queue().policy == QueuePolicy::drop_oldest ? "drop_oldest" : "block"},
                       {"dropped", exit ? std::exchange(dropped, 0) : 0}});
    }
  }
  return {{"format", "tofgraph-stats"},
          {"version", 1},
          {"frames", result.frames},
          {"dropped", result.dropped},
          {"wall_s", result.wall_s},
          {"frames_per_s", result.wall_s > 0 ? static_cast<double>(result.frames) / result.wall_s : 0.0},
          {"peak_memory_bytes", static_cast<std::uint64_t>(usage.ru_maxrss) * 1024},
          {"buffers_allocated", result.buffers_allocated},
          {"nodes", std::move(nodes)},
          {"edges", std::move(edges)}};
}

}  // namespace tofgraph::graph
