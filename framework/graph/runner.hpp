// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Runs a checked graph: frames flow through in order, several in flight.
#pragma once

#include "graph/graph.hpp"
#include "graph/run_statistics.hpp"

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::graph {

struct RunOptions {
  std::optional<std::uint64_t> frames;  ///< at most so many
  unsigned threads = 0;                 ///< 0: one a core
  /// Called with every frame that leaves a node, in order, before those that read it.
  std::map<std::string, std::function<void(tofgraph_frame&)>> receivers;
};

class Runner {
 public:
  Runner(Graph& graph, const RunOptions& options);
  ~Runner();

  /// Runs to the end of the source, the first error or stop(). Always drains and finishes what can be finished.
  RunResult run();
  /// Ends the run in order. [any thread]
  void stop();
  std::uint64_t frames_done() const;
  std::uint64_t frames_dropped() const;
  /// Frames that will come, 0 when unknown.
  std::uint64_t frames_expected() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tofgraph::graph
