// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Files that belong together, such as a model and the maps that it names.
#pragma once

#include "io/output_file.hpp"

#include <deque>

namespace tofgraph::io {

/// Files that are all written under temporary names before the first is renamed: if the disk is full, existing files
/// remain unchanged.
class OutputFiles {
 public:
  /// Adds a file, to be written before commit(). @throws std::runtime_error
  OutputFile& add(const std::filesystem::path& final_path) { return files_.emplace_back(final_path); }
  /// Marks a file of an earlier result for removal, which the new result does not contain. It need not exist.
  void drop(const std::filesystem::path& path) { stale_.push_back(path); }
  /// Renames in the order of add(), so that referenced files come before those naming them; then removes stale files.
  /// @throws std::runtime_error
  void commit();

 private:
  std::deque<OutputFile> files_;
  std::vector<std::filesystem::path> stale_;
};

}  // namespace tofgraph::io
