// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file `run --untrusted`: limits for a pipeline that somebody else wrote. See docs/SECURITY.md.
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
  std::size_t memory = std::size_t{4} << 30U;  ///< bytes beyond those of the program at its start
  std::uint64_t frames = 10000;                ///< unless the user states another number
  double time = 600;  ///< s, wall clock, reading the inputs included; unless the user states another
};

/// Leaves this process built-in plugins only, and at most so much more memory.
void restrict_process(const UntrustedLimits& limits);

/// @throws config::ConfigurationError a stage that reaches beyond files (a device, a network port), and a sink that
/// would replace files by itself (`overwrite: true`); with their places
void refuse_reach(const config::Value& pipeline);

/// @throws config::ConfigurationError the first node with an output outside the folder, or behind a link in it
void refuse_outputs_outside(const graph::Graph& graph, const std::filesystem::path& folder);

/// Ends a run after some time, also while it waits for an input: asks it like an interrupt does, and ends the process
/// with exit code 1 if it has not ended 10 s later.
class TimeLimit {
 public:
  /// @param limit s, of this object's life
  explicit TimeLimit(double limit);
  bool reached() const { return reached_; }

 private:
  std::atomic<bool> reached_ = false;
  std::jthread thread_;
};

}  // namespace tofgraph::cli
