// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Arguments of `tofgraph simulate`, implemented in simulate_module.cpp.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::cli {

struct SimulateArguments {
  std::string scene, out, model, preview, shard;
  std::optional<std::uint64_t> seed;
  std::int64_t frames = 0;  ///< 0: from the scene
  int compression = 0;
  unsigned threads = 0;  ///< 0: one per core
  bool truth = false, force = false, quiet = false;
  std::vector<std::filesystem::path> plugin_folders;
};

}  // namespace tofgraph::cli
