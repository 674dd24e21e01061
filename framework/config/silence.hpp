// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Silence of libraries on standard error.
#pragma once

namespace tofgraph::config {

/// Descriptor that the user reads: standard error, also while libraries are silenced. Async-signal-safe.
int standard_error();

/// Sends standard error nowhere as long as an object lives, but not the messages of this program: for libraries that
/// print what they think of a file. [any thread; objects of several threads share the redirection]
class SilentLibraries {
 public:
  SilentLibraries();
  ~SilentLibraries();
  SilentLibraries(const SilentLibraries&) = delete;
  SilentLibraries& operator=(const SilentLibraries&) = delete;
};

}  // namespace tofgraph::config
