// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Options with which files of other programs are read, and the request of `tofgraph convert --inspect`, whose
/// work is in convert_module.cpp.
#pragma once

#include "cli/run.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::cli {

struct InspectFileArguments {
  std::vector<std::string> files;
  std::vector<std::filesystem::path> plugin_folders;
};

/// Files, and the parameters of the stage file_reader as options.
struct ReadingArguments {
  RunArguments run;
  std::vector<std::string> files;
  std::string layout, as, unit, axes, invalid, integration_time, modulation_frequency, frame_rate;

  /// Adds all options but those of the files.
  void add_to(CLI::App& command);
};

/// The pipeline file_reader ! capture_writer with what was stated. @param out path of the capture
config::Value reading_pipeline(const ReadingArguments& arguments, const std::string& out);

}  // namespace tofgraph::cli
