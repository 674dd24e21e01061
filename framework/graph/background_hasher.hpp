// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The hashes of long inputs, made while frames flow.
#pragma once

#include "graph/graph.hpp"

#include <thread>

namespace tofgraph::graph {

/// As long as it lives, the hashes of inputs are made beside the run, for the stages that write them at its end.
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
          } catch (const std::exception&) {  // who needs the hash asks for it again, and has somebody to tell
          }
        }) {}

  /// From now on hashes are left out of the provenance.
  void stop() { graph_.host().hashing_stopped = true; }

 private:
  Graph& graph_;
  std::jthread thread_;
};

}  // namespace tofgraph::graph
