// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Files that belong together, as a model and the maps that it names.
#pragma once

#include "io/output_file.hpp"

#include <deque>

namespace tofgraph::io {

/// All are written under temporary names before the first gets its final one: where a disk is full, what was there
/// before stays as it was, and whole.
class OutputFiles {
 public:
  /// A new file, to be written by commit(). @throws std::runtime_error
  OutputFile& add(const std::filesystem::path& final_path) { return files_.emplace_back(final_path); }
  /// A file of a result before, which this one has not. It need not be there.
  void drop(const std::filesystem::path& path) { stale_.push_back(path); }
  /// Renames in the order of add(), so that what is named comes before what names it; removes what is stale last.
  /// @throws std::runtime_error
  void commit();

 private:
  std::deque<OutputFile> files_;
  std::vector<std::filesystem::path> stale_;
};

}  // namespace tofgraph::io
