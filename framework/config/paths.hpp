// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Paths of the program's own files: relative to the library, the same in the build tree and installed.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::config {

/// That of the program's own modules.
std::filesystem::path library_folder();
std::filesystem::path plugin_folder();  ///< lib/tofgraph/plugins
/// The folder below /usr/local where CMake installs plugins by default, for a program below /usr; else empty.
std::filesystem::path local_plugin_folder();
std::filesystem::path built_in_plugins();  ///< a list of the plugins that come with the program, a file name a line
std::filesystem::path command_folder();    ///< lib/tofgraph/commands: those that need more than the command line has
std::filesystem::path scanner();           ///< the program that reads descriptors in a process of its own
std::filesystem::path checker();           ///< the program that runs one check on one plugin
std::filesystem::path trial_program();     ///< the program that tries captures in a process of its own
std::filesystem::path profile_folder();    ///< share/tofgraph/profiles
std::filesystem::path template_folder();   ///< share/tofgraph/templates: what `plugin new` copies
std::filesystem::path cache_folder();      ///< $XDG_CACHE_HOME/tofgraph or ~/.cache/tofgraph

/// The ending of a file's name in lower case, e.g. ".ply" of PART.PLY.
std::string lower_case_ending(const std::filesystem::path& file);

/// Folders with colons between, apart and together.
std::vector<std::filesystem::path> split_path(std::string_view path);
std::string joined_path(const std::vector<std::filesystem::path>& folders);
/// TOFGRAPH_PLUGIN_PATH split at ':'.
std::vector<std::filesystem::path> plugin_path_from_environment();

}  // namespace tofgraph::config
