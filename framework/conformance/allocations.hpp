// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Memory that the process asks for: every way to the C library's memory is counted, the libraries' included. Linking
/// it replaces malloc and similar functions of a program; under a sanitizer nothing is counted.
#pragma once

#include <cstddef>

namespace tofgraph::conformance {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool memory_is_counted = false;
#else
inline constexpr bool memory_is_counted = true;
#endif

/// Counts calls while it lives, on all threads. One at a time.
class CountedCalls {
 public:
  CountedCalls();
  ~CountedCalls();
  CountedCalls(const CountedCalls&) = delete;
  CountedCalls& operator=(const CountedCalls&) = delete;
  static std::size_t count();  ///< of the last one
};

/// Bytes of the C library's memory that are in use.
std::size_t memory_in_use();

}  // namespace tofgraph::conformance
