// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Silence of libraries on standard error.
#pragma once

#include <mutex>
#include <string>

namespace tofgraph::config {

/// Descriptor that the user reads: standard error, also while libraries are silenced. Async-signal-safe.
int standard_error();

/// Keeps what is printed on standard error from the user as long as an object lives, but not the messages of this
/// program: for libraries that print what they think of a file. [any thread; one object at a time, others wait]
class SilentLibraries {
 public:
  SilentLibraries();
  ~SilentLibraries();
  SilentLibraries(const SilentLibraries&) = delete;
  SilentLibraries& operator=(const SilentLibraries&) = delete;

  /// Beginning of what was printed so far. @throws std::runtime_error where it cannot be known
  std::string words() const;

 private:
  std::unique_lock<std::mutex> alone_;
  int words_ = -1;  // file in memory
};

}  // namespace tofgraph::config
