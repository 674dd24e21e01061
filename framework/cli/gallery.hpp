// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Arguments of `tofgraph gallery`, implemented in gallery_module.cpp.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::cli {

struct GalleryArguments {
  std::string camera = "camcube2", out, light = "reference";
  bool force = false, quiet = false;
  std::vector<std::filesystem::path> plugin_folders;
};

}  // namespace tofgraph::cli
