// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Options for reading files of other programs, and the request of `tofgraph convert --inspect`, implemented in
/// convert_module.cpp.
#pragma once

#include "cli/run.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::cli {

struct InspectFileArguments {
  std::vector<std::string> files;
  std::string layout;  ///< file; empty: none
  std::vector<std::filesystem::path> plugin_folders;
};

/// Files, and the parameters of the stage file_reader as options.
struct ReadingArguments {
  RunArguments run;
  std::vector<std::string> files;
  std::string layout, as, unit, axes, invalid, integration_time, modulation_frequency, frame_rate;

  /// Adds all options except the files.
  void add_to(CLI::App& command);
  /// First given option that states the meaning of values or the metadata of frames; empty: none.
  std::string value_option() const;
};

/// Reads files and writes them as a capture. @param out path of the capture
/// @throws config::ConfigurationError whose positions are the options
int run_reading(const ReadingArguments& arguments, const std::string& out, const Common& common);

}  // namespace tofgraph::cli
