// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Requests of `tofgraph plugin`.
#pragma once

#include "cli/commands.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace tofgraph::cli {

/// Request of `plugin new`.
struct NewPlugin {
  std::string name, kind = "filter", language = "c++";
  std::string folder;  ///< empty: named after the plugin
};

/// Creates a folder with a plugin that builds and passes its test, from the installed templates.
/// @returns the exit code @throws config::ConfigurationError for an invalid name or a folder that is not empty
int new_plugin(const NewPlugin& plugin, const Common& common);

/// Request of `plugin check`.
struct CheckedPlugin {
  std::string file, only;             ///< name of a single check; empty: all
  unsigned strictness = 5;            ///< 1 to 10
  std::uint64_t seed = 1;             ///< seed of the random values
  std::vector<std::string> settings;  ///< PARAMETER=VALUE
  bool as_json = false, list = false;
};

/// Runs the plugin checks, each in a process of its own, and prints a table.
/// @returns the exit code: failed if any check fails @throws config::ConfigurationError
int check_plugin(const CheckedPlugin& plugin);

}  // namespace tofgraph::cli
