// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file File of a recording before it gets its final name: marking as being written, renaming. Internal to this
/// folder.
#pragma once

#include <filesystem>

namespace tofgraph::io {

/// Marks the file as being written during its lifetime; a kill of the process removes the mark.
class PartFile {
 public:
  /// @param path of an existing file. @throws std::runtime_error
  explicit PartFile(std::filesystem::path path);
  ~PartFile();
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;

  /// Syncs the file to disk. @throws std::runtime_error
  void sync() const;
  /// Renames it. @param overwrite an existing file of that name may be replaced @throws std::runtime_error
  void give_name(const std::filesystem::path& name, bool overwrite) const;

 private:
  std::filesystem::path path_;
  int descriptor_;
};

}  // namespace tofgraph::io
