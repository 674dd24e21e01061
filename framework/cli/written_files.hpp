// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Determines the files that a run created by comparing the folders before and after it.
#pragma once

#include "graph/graph.hpp"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace tofgraph::cli {

/// Created before the run. A node may write fewer files than it announced.
class WrittenFiles {
 public:
  explicit WrittenFiles(const graph::Graph& graph);

  /// New or replaced files of a node, by name, for each of its outputs.
  std::vector<std::filesystem::path> of(const graph::Node& node) const;
  /// `wrote 9 files: out/a.pcd ... out/c.png`; empty: none.
  std::string summary(const graph::Graph& graph) const;
  /// Files of a series left by an earlier run and not replaced by this one, in one line; empty: none.
  /// @param pattern one of graph::output_files(), with canonical folders
  std::string older(const io::OutputPattern& pattern) const;

 private:
  bool is_new(const std::filesystem::path& file) const;

  std::map<std::filesystem::path, std::filesystem::file_time_type> before_;
};

}  // namespace tofgraph::cli
