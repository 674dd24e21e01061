// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Limits of this process: for the trial of files, and for pipelines that somebody else wrote.
#pragma once

#include <cstddef>
#include <optional>

namespace tofgraph::config {

struct ProcessLimits {
  std::size_t memory;                                  ///< bytes beyond what the process has now
  std::optional<unsigned> cpu_seconds = std::nullopt;  ///< none: as before
};

/// From now on allocations beyond the limit fail, and the process ends when it computes for longer. Leaves no core
/// dump.
void limit_process(const ProcessLimits& limits);

}  // namespace tofgraph::config
