// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Trying something out where a crash does no harm. For this folder only.
#pragma once

#include <cstddef>
#include <functional>

namespace tofgraph::io {

/// What a trial may take before it is ended.
struct TrialLimits {
  std::size_t memory;  ///< bytes beyond what the process has now
  unsigned cpu_seconds;
};

/// Runs `work` in a child process of its own. HDF5 trusts what it reads: on damaged files it can crash, loop or ask for
/// any amount of memory, and an error code cannot tell.
/// @throws std::runtime_error with the text of what `work` threw, or saying that it crashed
void try_in_child(const TrialLimits& limits, const std::function<void()>& work);

}  // namespace tofgraph::io
