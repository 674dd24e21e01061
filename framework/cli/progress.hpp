// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A bar on the terminal for what takes longer than two seconds.
#pragma once

#include <fmt/format.h>

#include <unistd.h>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <mutex>
#include <string>
#include <string_view>

namespace tofgraph::cli {

/// `[=====     ]  50 % text`
inline std::string progress_bar(double share, std::string_view text) {
  constexpr int width = 30;
  const int full = std::clamp(static_cast<int>(share * width), 0, width);
  return fmt::format("[{}{}] {:3.0f} % {}", std::string(static_cast<std::size_t>(full), '='),
                     std::string(static_cast<std::size_t>(width - full), ' '), share * 100, text);
}

/// Draws on standard error where that is a terminal, not before two seconds and five times a second. Thread-safe.
class Progress {
 public:
  explicit Progress(bool quiet) : shown_(!quiet && isatty(STDERR_FILENO) != 0) {}
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Takes the bar away, before a result is printed.
  void clear() {
    const std::lock_guard lock(mutex_);
    if (drawn_) fmt::print(stderr, "\r\033[K");
    drawn_ = false;
  }

  void show(double share, std::string_view text) {
    if (!shown_) return;
    const std::lock_guard lock(mutex_);
    const auto now = Clock::now();
    if (now < next_) return;
    next_ = now + std::chrono::milliseconds(200);
    fmt::print(stderr, "\r\033[K{}", progress_bar(share, text));
    std::fflush(stderr);
    drawn_ = true;
  }

 private:
  using Clock = std::chrono::steady_clock;
  bool shown_, drawn_ = false;
  Clock::time_point next_ = Clock::now() + std::chrono::seconds(2);
  std::mutex mutex_;
};

}  // namespace tofgraph::cli
