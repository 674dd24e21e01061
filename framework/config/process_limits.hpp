// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Limits of this process: for probing files and for pipelines from untrusted authors.
#pragma once

#include <cstddef>
#include <optional>

namespace tofgraph::config {

struct ProcessLimits {
  std::size_t memory;                                  ///< bytes beyond the current use
  std::optional<unsigned> cpu_seconds = std::nullopt;  ///< none: unchanged
};

/// Limits this process from now on: allocations beyond the limit fail, and exceeding the CPU time ends the process.
/// Disables core dumps.
void limit_process(const ProcessLimits& limits);

}  // namespace tofgraph::config
