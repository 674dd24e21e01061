// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Arguments of `tofgraph report`, implemented in report_module.cpp.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::cli {

struct ReportArguments {
  std::string campaign, out, model;
  unsigned threads = 0;  ///< 0: one per core
  bool force = false, quiet = false;
  std::vector<std::filesystem::path> plugin_folders;
};

}  // namespace tofgraph::cli
