// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Request of `tofgraph convert --inspect`; the work is in convert_module.cpp.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::cli {

struct InspectFileArguments {
  std::vector<std::string> files;
  std::vector<std::filesystem::path> plugin_folders;
};

}  // namespace tofgraph::cli
