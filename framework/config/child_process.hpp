// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Runs another program to its end: the plugin scanner, the probe of a capture, gnuplot.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace tofgraph::config {

struct ChildOptions {
  std::string input = {};    ///< content of its standard input
  bool keep_errors = false;  ///< true: its standard error is collected; false: it is that of this process
  /// Called whenever no output arrived for this long; zero: never.
  std::chrono::milliseconds patience{0};
  std::function<void(const std::string& output)> on_silence = {};
  std::chrono::milliseconds limit{0};  ///< the child is killed after this time; zero: never
};

struct ChildResult {
  std::string output, errors;
  std::int64_t exit_code = 0;
  int signal = 0;         ///< signal that ended it; 0: none
  bool overtime = false;  ///< killed at its time limit

  bool ok() const { return exit_code == 0 && signal == 0; }
};

/// Runs a program and collects its output. [any thread]
/// @param command the program, by path or by a name in PATH, and its arguments
/// @throws std::runtime_error if it cannot be started, with only the system's reason as text
ChildResult run_child(std::vector<std::string> command, const ChildOptions& options = {});

}  // namespace tofgraph::config
