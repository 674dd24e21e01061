// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Which files a run has made, told from what lies in the folders before and after it.
#pragma once

#include "graph/graph.hpp"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace tofgraph::cli {

/// Made before the run. What a node announces may not come, and what comes may be less than it announces.
class WrittenFiles {
 public:
  explicit WrittenFiles(const graph::Graph& graph);

  /// The files of a node that are new or replaced, by name for each of its outputs.
  std::vector<std::filesystem::path> of(const graph::Node& node) const;
  /// `wrote 9 files: out/a.pcd ... out/c.png`; empty: none.
  std::string summary(const graph::Graph& graph) const;
  /// Files of a series from a former run that this one did not replace, in one line; empty: none.
  /// @param pattern one of graph::output_files(), whose folders have their one name
  std::string older(const io::OutputPattern& pattern) const;

 private:
  bool is_new(const std::filesystem::path& file) const;

  std::map<std::filesystem::path, std::filesystem::file_time_type> before_;
};

}  // namespace tofgraph::cli
