// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Notes to the user on a result that has a report.
#pragma once

#include "config/say.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

namespace tofgraph::cli {

/// The first ones; the report has them all.
inline void say_notes(const std::vector<std::string>& notes) {
  constexpr std::size_t shown = 8;
  for (std::size_t i = 0; i < std::min(shown, notes.size()); ++i) config::say("note: " + notes[i]);
  if (notes.size() > shown) config::say(fmt::format("note: {} more are in the report", notes.size() - shown));
}

}  // namespace tofgraph::cli
