// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Help texts of the command line, and messages on its errors.
#pragma once

#include <CLI/CLI.hpp>

#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace tofgraph::cli {

/// Help in words: each option's value as its option_text() names it (N, FILE), and with a command's options those of
/// all commands.
std::shared_ptr<CLI::FormatterBase> help_in_words();

/// Message on the first unknown word, with the nearest known one; empty: all words are known.
std::string unknown_word(const CLI::App& app);

/// Message on an error of the command line, with an example of the command.
std::string usage_problem(const CLI::App& app, const CLI::ParseError& error);

/// Checks of an option's value, with the reason in words.
CLI::Validator whole_number(std::int64_t minimum, std::int64_t maximum = std::numeric_limits<std::int64_t>::max());
CLI::Validator one_of(std::vector<std::string> words);

}  // namespace tofgraph::cli
