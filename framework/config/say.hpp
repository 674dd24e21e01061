// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Messages on standard error, from wherever in the process they come.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace tofgraph::config {

/// A message on standard error, on a line of its own: where a progress bar stands on the terminal's last line, it takes
/// that. [any thread]
void say(const std::string& text);

/// States whether a progress bar is on the terminal's last line.
void set_bar_stands(bool stands);

/// `1 frame`, `2 frames`
std::string counted(std::uint64_t number, std::string_view noun);

}  // namespace tofgraph::config
