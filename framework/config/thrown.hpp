// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Description of an exception, for threads that cannot propagate it.
#pragma once

#include <exception>
#include <new>
#include <string>

namespace tofgraph::config {

inline constexpr const char* no_memory = "out of memory";  ///< short enough for a std::string without heap memory

/// Returns a description of the current exception, in a catch clause. Does not allocate.
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
