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

/// Help text: each option's value is named by its option_text() (N, FILE); a command's options are followed by those of
/// all commands.
std::shared_ptr<CLI::FormatterBase> help_in_words();

/// Message about the first unknown word, with the nearest known one; empty if all words are known.
std::string unknown_word(const CLI::App& app);

/// Message about a command-line error, with an example of the command.
std::string usage_problem(const CLI::App& app, const CLI::ParseError& error);

/// Adds an older spelling of an option, which still works but is not shown. @param option the new one; if it takes one
/// value, using both is an error; if it takes a list, the values are joined
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

/// Checks of an option's value; each returns the reason for a rejection.
CLI::Validator whole_number(std::int64_t minimum, std::int64_t maximum = std::numeric_limits<std::int64_t>::max());
CLI::Validator one_of(std::vector<std::string> words);

}  // namespace tofgraph::cli
