// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Paths of the program's own files: relative to the library, the same in the build tree and installed.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::config {

/// Folder of the program's own modules.
std::filesystem::path library_folder();
std::filesystem::path plugin_folder();  ///< lib/tofgraph/plugins
/// Folder below /usr/local where CMake installs plugins by default, for a program below /usr; else empty.
std::filesystem::path local_plugin_folder();
std::filesystem::path built_in_plugins();  ///< list of the installation's plugins, one file name per line
std::filesystem::path command_folder();    ///< lib/tofgraph/commands: modules of commands with further libraries
std::filesystem::path scanner();           ///< program that reads descriptors in a separate process
std::filesystem::path checker();           ///< program that runs one check on one plugin
std::filesystem::path trial_program();     ///< program that probes captures in a separate process
std::filesystem::path profile_folder();    ///< share/tofgraph/profiles
std::filesystem::path template_folder();   ///< share/tofgraph/templates: copied by `plugin new`
std::filesystem::path cache_folder();      ///< $XDG_CACHE_HOME/tofgraph or ~/.cache/tofgraph

/// File extension in lower case, e.g. ".ply" of PART.PLY.
std::string lower_case_ending(const std::filesystem::path& file);

/// Splits a list of folders at colons, and joins them.
std::vector<std::filesystem::path> split_path(std::string_view path);
std::string joined_path(const std::vector<std::filesystem::path>& folders);
/// TOFGRAPH_PLUGIN_PATH split at ':'.
std::vector<std::filesystem::path> plugin_path_from_environment();

}  // namespace tofgraph::config
