// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Memory allocations of the process: every allocation from the C library is counted, including those of other
/// libraries. Linking this file replaces malloc and similar functions; under a sanitizer nothing is counted.
#pragma once

#include <cstddef>

namespace tofgraph::conformance {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool memory_is_counted = false;
#else
inline constexpr bool memory_is_counted = true;
#endif

/// Counts calls on all threads during its lifetime. One object at a time.
class CountedCalls {
 public:
  CountedCalls();
  ~CountedCalls();
  CountedCalls(const CountedCalls&) = delete;
  CountedCalls& operator=(const CountedCalls&) = delete;
  static std::size_t count();  ///< by the last object
};

/// Memory of the C library in use, bytes.
std::size_t memory_in_use();

}  // namespace tofgraph::conformance
