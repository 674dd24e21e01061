// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Arguments of `tofgraph diagnose`, implemented in diagnose_module.cpp.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::cli {

struct DiagnoseArguments {
  std::string model, data, out;
  std::string time_limit;  ///< "": none
  std::string shard;       ///< of the --confidence cases; "": all
  std::vector<std::string> without, skip;
  std::size_t max_effects = 6;
  static constexpr std::size_t usual_max_conditions = 500;
  std::size_t max_conditions = usual_max_conditions;  ///< that are searched
  std::size_t confidence = 0;                         ///< injected cases
  std::size_t resample = 0;                           ///< number of random halves
  std::uint64_t seed = 1;
  unsigned threads = 0;  ///< 0: one per core
  bool skip_missing = false, other_serial = false, force = false, quiet = false;
  std::vector<std::filesystem::path> plugin_folders;
  std::vector<std::filesystem::path> plugin_path;  ///< from --plugin-path
};

}  // namespace tofgraph::cli
