// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Description of an exception, for threads that cannot pass it on.
#pragma once

#include <exception>
#include <new>
#include <string>

namespace tofgraph::config {

inline constexpr const char* no_memory = "out of memory";  ///< so short that a std::string of it needs no memory

/// Description of the exception in a catch clause. Works without memory.
inline std::string what_was_thrown() noexcept {
  try {
    try {
      throw;
    } catch (const std::bad_alloc&) {
      return no_memory;
    } catch (const std::exception& error) {
      return error.what();
    } catch (...) {
      return "threw something that is not a std::exception";
    }
  } catch (...) {
    return no_memory;
  }
}

}  // namespace tofgraph::config
