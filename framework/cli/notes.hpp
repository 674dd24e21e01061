// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Notes on a result that has a report.
#pragma once

#include "config/log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

namespace tofgraph::cli {

/// Prints the first few; the report lists all.
inline void say_notes(const std::vector<std::string>& notes) {
  constexpr std::size_t shown = 8;
  for (std::size_t i = 0; i < std::min(shown, notes.size()); ++i) config::print_message("note: " + notes[i]);
  if (notes.size() > shown) config::print_message(fmt::format("note: {} more are in the report", notes.size() - shown));
}

}  // namespace tofgraph::cli
