// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Changes of LIVE parameters while a graph runs.
#pragma once

#include "graph/graph.hpp"
#include "graph/run_statistics.hpp"

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::graph {

/// Passes changes from any thread to the source's thread, which applies them while no frame is in flight. Each frame is
/// thus computed with one consistent set of values, and the number of the first frame with the new value is known.
class LiveChanges {
 public:
  explicit LiveChanges(Graph& graph) : graph_(graph) {}

  /// Requests a change and waits for it. [any thread] @param value as written in a pipeline
  /// @returns "node", "parameter", "value" and "frame", the first frame with it; "pending" instead of "frame" if the
  /// source delivered nothing for 2 s. @throws std::runtime_error the reason for a refusal
  nlohmann::json request(const std::string& node, const std::string& parameter, const std::string& value);

  /// Returns whether changes are waiting. [thread of the source]
  bool pending() const { return pending_.load(); }
  /// Applies the waiting changes. [thread of the source, no frame in flight] @param frame the next number
  void apply(std::uint64_t frame);
  /// Refuses waiting and further changes because the run is over.
  void end();

  /// LIVE parameters with their values. [any thread]
  nlohmann::json parameters(const Node& node) const;
  /// The last 20 changes; with "problem" those refused after "pending". [any thread]
  nlohmann::json done() const;

 private:
  struct Request {
    Node* node = nullptr;
    std::string parameter, value, problem;
    std::uint64_t frame = 0;
    bool settled = false, told_pending = false;
  };

  Node& node_named(const std::string& name) const;
  void settle(Request& request, std::uint64_t frame);
  /// Records a change or refusal that can no longer be reported to the caller.
  void keep(const Request& request, nlohmann::json entry);

  Graph& graph_;
  std::atomic<bool> pending_ = false;
  mutable std::mutex mutex_;  // guards the members below and the values of the nodes
  std::condition_variable settled_;
  std::vector<std::shared_ptr<Request>> waiting_;
  nlohmann::json done_ = nlohmann::json::array();
  bool ended_ = false;
};

/// Returns the nodes with inputs, outputs, LIVE parameters and times, and the changes so far. [any thread]
nlohmann::json state_json(const Graph& graph, std::span<const TimeHistogram> times, const LiveChanges& changes);

}  // namespace tofgraph::graph
