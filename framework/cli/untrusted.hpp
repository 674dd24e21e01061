// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file `run --untrusted`: limits for a pipeline that somebody else wrote. See docs/SECURITY.md.
#pragma once

#include "config/document.hpp"
#include "graph/graph.hpp"
#include "graph/runner.hpp"

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <thread>

namespace tofgraph::cli {

/// Limits of an untrusted run.
struct UntrustedLimits {
  std::size_t memory = std::size_t{4} << 30U;  ///< bytes beyond those of the program at its start
  std::uint64_t frames = 10000;                ///< unless the user states another number
  std::chrono::seconds time{600};              ///< of the run, wall clock
};

/// Leaves this process built-in plugins only, and at most so much more memory.
void restrict_process(const UntrustedLimits& limits);

/// @throws config::ConfigurationError a stage that reaches beyond files: a device, a network port; with its place
void refuse_devices(const config::Value& pipeline);

/// @throws config::ConfigurationError the first node with an output outside the folder, links followed
void refuse_outputs_outside(const graph::Graph& graph, const std::filesystem::path& folder);

/// Timer that ends a run in order.
class TimeLimit {
 public:
  TimeLimit(graph::Runner& runner, std::chrono::seconds limit);
  ~TimeLimit();
  TimeLimit(const TimeLimit&) = delete;
  TimeLimit& operator=(const TimeLimit&) = delete;
  bool reached() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable ended_;
  bool over_ = false, reached_ = false;
  std::thread thread_;
};

}  // namespace tofgraph::cli
