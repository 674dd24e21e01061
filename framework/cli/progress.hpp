// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Progress bar on the terminal for work that takes longer than two seconds.
#pragma once

#include "config/log.hpp"

#include <fmt/format.h>
#include <tofgraph/physics/to_integer.hpp>

#include <sys/ioctl.h>
#include <unistd.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

namespace tofgraph::cli {

using config::print_message;

/// `7 s`, `3 min 05 s`, `2 h 10 min`
inline std::string duration_text(double seconds) {
  const auto s = physics::to_integer(std::max(0.0, seconds), std::int64_t{0});
  if (s < 60) return fmt::format("{} s", s);
  return s < 3600 ? fmt::format("{} min {:02} s", s / 60, s % 60)
                  : fmt::format("{} h {:02} min", s / 3600, s / 60 % 60);
}

/// `[=====     ]  50 % text, 12 s, 12 s left`; without a fraction `text, 12 s`.
inline std::string progress_bar(std::optional<double> share, std::string_view text, double elapsed) {
  if (!share) return fmt::format("{}, {}", text, duration_text(elapsed));
  constexpr int width = 20;
  const double done = std::isnan(*share) ? 0 : std::clamp(*share, 0.0, 1.0);
  const int full = static_cast<int>(done * width);
  std::string bar =
      fmt::format("[{}{}] {:3.0f} % {}, {}", std::string(static_cast<std::size_t>(full), '='),
                  std::string(static_cast<std::size_t>(width - full), ' '), done * 100, text, duration_text(elapsed));
  if (done > 0.01 && done < 1) bar += fmt::format(", {} left", duration_text(elapsed * (1 - done) / done));
  return bar;
}

/// Progress bar on standard error if that is a terminal: first drawn after two seconds, at most five times a second,
/// never going back. It remains as a separate line. Thread-safe.
class Progress {
 public:
  explicit Progress(bool quiet) : shown_(!quiet && isatty(STDERR_FILENO) != 0) {}
  ~Progress() { finish(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Ends the line of the bar before a result is printed.
  void finish() {
    const std::lock_guard lock(mutex_);
    if (drawn_) {
      draw();
      fmt::print(stderr, "\n");
    }
    drawn_ = false;
    config::set_bar_stands(false);
  }

  /// @param share completed fraction, 0 to 1; none: unknown
  void show(std::optional<double> share, std::string_view text) {
    if (!shown_) return;
    const std::lock_guard lock(mutex_);
    if (share) share_ = std::max(*share, share_.value_or(0));
    text_ = text;
    const auto now = Clock::now();
    if (now < next_) return;
    next_ = now + std::chrono::milliseconds(200);
    draw();
    drawn_ = true;
    config::set_bar_stands(true);
  }

 private:
  using Clock = std::chrono::steady_clock;

  void draw() const {
    const double elapsed = std::chrono::duration<double>(Clock::now() - start_).count();
    std::string line = progress_bar(share_, text_, elapsed);
    winsize size{};  // a wrapped line could not be overwritten
    if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 && line.size() >= size.ws_col)
      line.resize(size.ws_col - 1U);
    fmt::print(stderr, "\r\033[K{}", line);
    std::fflush(stderr);
  }

  bool shown_, drawn_ = false;
  std::optional<double> share_;
  std::string text_;
  Clock::time_point start_ = Clock::now(), next_ = start_ + std::chrono::seconds(2);
  std::mutex mutex_;
};

}  // namespace tofgraph::cli
