// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Help texts of the command line, and messages on its errors.
#pragma once

#include <CLI/CLI.hpp>

#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

namespace tofgraph::cli {

/// Help in words: each option's value as its option_text() names it (N, FILE), and with a command's options those of
/// all commands.
std::shared_ptr<CLI::FormatterBase> help_in_words();

/// Message on the first unknown word, with the nearest known one; empty: all words are known.
std::string unknown_word(const CLI::App& app);

/// Message on an error of the command line, with an example of the command.
std::string usage_problem(const CLI::App& app, const CLI::ParseError& error);

/// An older spelling of an option, which works and is not shown. @param option the new one; of options that have one
/// value both at once are refused, of lists they add up
template <class T> CLI::Option* add_old_spelling(CLI::App& command, CLI::Option* option, const char* old, T& value) {
  if constexpr (std::is_same_v<T, bool>)
    return command.add_flag(old, value)->group("")->excludes(option);
  else if constexpr (std::is_same_v<T, std::vector<std::string>>)
    return command
        .add_option_function<T>(old, [&value](const T& more) { value.insert(value.end(), more.begin(), more.end()); })
        ->group("");
  else
    return command.add_option(old, value)->group("")->excludes(option);
}

/// Checks of an option's value, with the reason in words.
CLI::Validator whole_number(std::int64_t minimum, std::int64_t maximum = std::numeric_limits<std::int64_t>::max());
CLI::Validator one_of(std::vector<std::string> words);

}  // namespace tofgraph::cli
