// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Reports a plugin that keeps the program waiting before a run has begun.
#pragma once

#include "cli/commands.hpp"
#include "graph/running_call.hpp"

#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <thread>

namespace tofgraph::cli {

/// Reports once, during its lifetime, each plugin call that takes longer than the given number of seconds.
class SlowCalls {
 public:
  explicit SlowCalls(double seconds)
      : thread_([this, seconds](const std::stop_token& stop) {
          try {
            watch(stop, seconds);
          } catch (const std::exception&) {  // no memory for the message: the call itself continues
          }
        }) {}

 private:
  void watch(const std::stop_token& stop, double seconds) {
    std::unique_lock lock(mutex_);
    while (!stop.stop_requested()) {
      wake_.wait_for(lock, stop, std::chrono::milliseconds(100), [] { return false; });
      const std::vector<std::string> calls = graph::calls_longer_than(seconds);
      for (const std::string& call : calls) print_message(call);
      if (!calls.empty()) return;
    }
  }

  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::jthread thread_;
};

}  // namespace tofgraph::cli
