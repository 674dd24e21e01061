// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Runs a checked graph: frames are processed in order, several in flight.
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
  std::optional<std::uint64_t> frames;  ///< upper limit
  unsigned threads = 0;                 ///< 0: one per core
  /// Called with every frame that leaves a node, in order, before its readers run.
  std::map<std::string, std::function<void(tofgraph_frame&)>> receivers;
};

class Runner {
 public:
  Runner(Graph& graph, const RunOptions& options);
  ~Runner();

  /// Runs until the source ends, an error or stop(). Always drains and finishes as much as possible.
  RunResult run();
  /// Ends the run cleanly. [any thread]
  void stop();
  std::uint64_t frames_done() const;
  std::uint64_t frames_dropped() const;
  /// Expected number of frames, 0 if unknown.
  std::uint64_t frames_expected() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tofgraph::graph
