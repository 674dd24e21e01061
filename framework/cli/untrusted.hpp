// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file `run --untrusted`: limits for a pipeline from an untrusted author. See docs/SECURITY.md.
#pragma once

#include "config/document.hpp"
#include "graph/graph.hpp"

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <thread>

namespace tofgraph::cli {

/// Limits of an untrusted run.
struct UntrustedLimits {
  std::size_t memory = std::size_t{4} << 30U;  ///< bytes beyond the program's memory at its start
  std::uint64_t frames = 10000;                ///< default, which the user may change
  double time = 600;  ///< s, wall-clock time including the reading of inputs; default, which the user may change
};

/// Restricts this process to built-in plugins and limits its additional memory.
void restrict_process(const UntrustedLimits& limits);

/// @throws config::ConfigurationError for a stage that uses more than files (a device, a network port) or a sink that
/// replaces files (`overwrite: true`); with their positions
void refuse_reach(const config::Value& pipeline);

/// @throws config::ConfigurationError for the first node with an output outside the folder, or behind a link in it
void refuse_outputs_outside(const graph::Graph& graph, const std::filesystem::path& folder);

/// Ends a run after a time limit, also while it waits for an input: requests the end like an interrupt and, after
/// another 10 s, ends the process with exit code 1.
class TimeLimit {
 public:
  /// @param limit s, from the construction of this object
  explicit TimeLimit(double limit);
  bool reached() const { return reached_; }

 private:
  std::atomic<bool> reached_ = false;
  std::jthread thread_;
};

}  // namespace tofgraph::cli
