// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Records which plugin call each thread is in, so that a crash or an endless loop can be attributed to a plugin.
/// Entering and leaving cost a few stores; reading is safe in a signal handler.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace tofgraph::graph {

class Instance;

class RunningCall {
 public:
  static constexpr std::uint64_t no_frame = UINT64_MAX;
  /// @param what a literal: create, prepare, process, finish, destroy, apply
  RunningCall(const Instance& instance, const char* what, std::uint64_t frame = no_frame);
  ~RunningCall();
  RunningCall(const RunningCall&) = delete;
  RunningCall& operator=(const RunningCall&) = delete;

 private:
  void* slot_;
};

/// Installs a handler that reports the node, frame and plugin of a crash before the program ends as usual.
void install_crash_handler();

/// Writes that a library is about to end the program, and which node, frame and plugin was running: on this thread,
/// else on any other. Safe wherever a library may call exit(). @param call a literal: exit, _exit, quick_exit
void tell_ending(const char* call, int code);

/// Calls that have been running for at least this long, one per line.
std::vector<std::string> calls_longer_than(double seconds);

}  // namespace tofgraph::graph
