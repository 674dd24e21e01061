// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Interrupts, and the progress of a run on the terminal.
#pragma once

#include "cli/progress.hpp"
#include "graph/runner.hpp"
#include "graph/running_call.hpp"

#include <fmt/format.h>

#include <sys/syscall.h>
#include <unistd.h>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <limits>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

namespace tofgraph::cli {

/// Set in a signal handler, read by another thread.
inline std::atomic<int> signals = 0;
static_assert(std::atomic<int>::is_always_lock_free);

inline void on_signal(int) {
  if (signals != 0) syscall(SYS_exit_group, 130);  // a second interrupt ends the process at once
  signals = 1;
}

/// Counts interrupts from now on; blocking system calls are woken.
inline void handle_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

/// Watches a run from a separate thread: passes interrupts on, reports the calls that delay the end, shows progress.
class Watch {
 public:
  /// @param most time limit after the first frame, s; the run is then ended cleanly
  Watch(graph::Runner& runner, bool quiet, double most = std::numeric_limits<double>::infinity())
      : runner_(runner), most_(most), progress_(quiet), thread_([this](const std::stop_token& stop) { watch(stop); }) {}

 private:
  void watch(const std::stop_token& stop) {
    bool passed_on = false, told = false;
    double interrupted_at = 0;
    while (!stop.stop_requested()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      const double seconds = elapsed();
      if (signals != 0 && !passed_on) {
        passed_on = true;
        interrupted_at = seconds;
        runner_.stop();
      }
      if (!first_frame_at_ && runner_.frames_done() != 0) first_frame_at_ = seconds;
      if (!time_is_up_ && first_frame_at_ && seconds - *first_frame_at_ >= most_) {
        time_is_up_ = true;
        runner_.stop();
      }
      try {
        if (passed_on && !told && seconds > interrupted_at + patience) told = tell_whom_it_waits_for();
        show();
      } catch (const std::exception&) {  // no memory for the message: keeps watching
      }
    }
    try {
      show();
      progress_.finish();
    } catch (const std::exception&) {  // the run itself has ended
    }
  }

  /// @returns whether there was one
  static bool tell_whom_it_waits_for() {
    const std::vector<std::string> calls = graph::calls_longer_than(patience);
    for (const std::string& call : calls) print_message("still waiting: " + call);
    if (!calls.empty())
      print_message("a second interrupt (Ctrl-C) ends the program at once, with its outputs incomplete");
    return !calls.empty();
  }

  void show() {
    const std::uint64_t frames = runner_.frames_done(), expected = runner_.frames_expected();
    std::optional<double> share;
    if (expected != 0)
      share = static_cast<double>(frames) / static_cast<double>(expected);
    else if (first_frame_at_ && std::isfinite(most_))
      share = std::min((elapsed() - *first_frame_at_) / most_, 1.0);
    std::string text = expected != 0 ? fmt::format("{} of {}", frames, config::counted(expected, "frame"))
                                     : config::counted(frames, "frame");
    text += fmt::format(", {:.1f} frames/s", static_cast<double>(frames) / elapsed());
    if (runner_.frames_dropped() != 0) text += fmt::format(", {} dropped", runner_.frames_dropped());
    progress_.show(share, text);
  }

  double elapsed() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

  using Clock = std::chrono::steady_clock;
  static constexpr double patience = 2;  ///< s, allowed for a call to end after an interrupt
  graph::Runner& runner_;
  double most_;  // s
  Progress progress_;
  Clock::time_point start_ = Clock::now();
  std::optional<double> first_frame_at_;  // s
  bool time_is_up_ = false;
  std::jthread thread_;
};

}  // namespace tofgraph::cli
