// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Files generated from the declarations: man pages, shell completion, reference pages, schemas, type stubs.
#pragma once

#include "cli/commands.hpp"

#include <filesystem>
#include <string>

namespace CLI {
class Option;
}

namespace tofgraph::cli {

/// Options and arguments of a command that its help shows.
std::vector<const CLI::Option*> shown_options(const CLI::App& command);
/// "--frames N", "-o, --out FILE" or "PIPELINE".
std::string option_words(const CLI::Option& option);
/// Subcommands in the order of their declaration, without hidden ones.
std::vector<const CLI::App*> shown_commands(const CLI::App& command);

/// Writes share/man/man1/*.1 and the completions for bash and zsh to a folder. @param app the whole command line
void write_manual(const CLI::App& app, const std::filesystem::path& folder);

/// Writes one page for the commands and one for each kind of plugin, and pipeline.json and model.json: JSON Schema
/// draft 7, used by editors to complete and check YAML.
void write_reference(const CLI::App& app, const std::filesystem::path& folder);
void write_schemas(const std::filesystem::path& folder);
/// Writes _stages.pyi, which declares the stages and their parameters to Python editors and type checkers.
void write_stubs(const std::filesystem::path& folder);

}  // namespace tofgraph::cli
