// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file How the command line is explained, and what is said of a word that it does not know.
#pragma once

#include <memory>
#include <string>

namespace CLI {
class App;
class FormatterBase;
}  // namespace CLI

namespace tofgraph::cli {

/// Help in words: each option's value as its option_text() names it (N, FILE), and with a command's options those of
/// all commands.
std::shared_ptr<CLI::FormatterBase> help_in_words();

/// What is wrong with the first word that nobody took, with the nearest one that there is; empty: each had its taker.
std::string unknown_word(const CLI::App& app);

}  // namespace tofgraph::cli
