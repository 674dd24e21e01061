// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Silences libraries on standard error.
#pragma once

#include <mutex>
#include <string>

namespace tofgraph::config {

/// Descriptor read by the user: standard error, also while libraries are silenced. Async-signal-safe.
int standard_error();

/// Hides output to standard error during its lifetime, except messages of this program: for libraries that print their
/// own errors about a file. [any thread; one object at a time, others wait]
class SilentLibraries {
 public:
  SilentLibraries();
  ~SilentLibraries();
  SilentLibraries(const SilentLibraries&) = delete;
  SilentLibraries& operator=(const SilentLibraries&) = delete;

  /// Beginning of the hidden output so far. @throws std::runtime_error if it cannot be read
  std::string words() const;

 private:
  std::unique_lock<std::mutex> alone_;
  int words_ = -1;  // in-memory file
};

}  // namespace tofgraph::config
