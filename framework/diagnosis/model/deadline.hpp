// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The time at which a computation is abandoned.
#pragma once

#include <chrono>
#include <stdexcept>

namespace tofgraph::diagnosis {

/// Abandons a computation, which leaves nothing behind.
struct TimeExpired : std::runtime_error {
  TimeExpired() : std::runtime_error("the time limit ended the search") {}
};

class Deadline {
 public:
  using Clock = std::chrono::steady_clock;

  Deadline() = default;  ///< never
  explicit Deadline(Clock::time_point at) : at_(at) {}

  bool has_passed() const { return at_ != Clock::time_point::max() && Clock::now() >= at_; }
  /// @throws TimeExpired
  void check() const {
    if (has_passed()) throw TimeExpired();
  }

 private:
  Clock::time_point at_ = Clock::time_point::max();
};

/// Deadlines of the parts of a run that together must not take longer than a limit.
struct TimeLimit {
  double seconds = 0;  ///< 0: none
  Deadline::Clock::time_point begin = Deadline::Clock::now();

  /// @param share of the limit, counted from the begin
  Deadline at(double share) const {
    if (!(seconds > 0)) return {};
    return Deadline(
        begin + std::chrono::duration_cast<Deadline::Clock::duration>(std::chrono::duration<double>(share * seconds)));
  }
};

}  // namespace tofgraph::diagnosis
