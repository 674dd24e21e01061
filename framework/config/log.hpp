// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Messages on standard error, from any part of the process.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace tofgraph::config {

/// Writes a message to standard error on a line of its own; if a progress bar occupies the terminal's last line, the
/// message replaces it. [any thread]
void print_message(const std::string& text);

/// Sets whether a progress bar occupies the terminal's last line.
void set_bar_stands(bool stands);

/// `1 frame`, `2 frames`
std::string counted(std::uint64_t number, std::string_view noun);

}  // namespace tofgraph::config
