// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Computes the hashes of long input files while frames are processed.
#pragma once

#include "graph/graph.hpp"

#include <thread>

namespace tofgraph::graph {

/// Hashes the input files in the background, for the stages that write a provenance at the end of the run.
class BackgroundHasher {
 public:
  explicit BackgroundHasher(Graph& graph)
      : graph_(graph), thread_([&graph](const std::stop_token& over) {
          const auto stopped = [&] { return over.stop_requested() || !graph.host().wants_hashes(); };
          try {
            for (const auto& writer : graph.nodes()) {
              if (!writer->wants_provenance()) continue;
              for (const std::size_t step : graph.steps_to(writer->index)) {
                for (const UsedFile& file : graph.nodes()[step]->files()) file.hash->get(stopped);
              }
            }
          } catch (const std::exception&) {  // reported when the hash is requested again
          }
        }) {}

  /// Leaves the missing hashes out of the provenance from now on.
  void stop() { graph_.host().hashing_stopped = true; }

 private:
  Graph& graph_;
  std::jthread thread_;
};

}  // namespace tofgraph::graph
