// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The file that a recording is until it has its name: who is writing it, how it gets the name. For this folder
/// only.
#pragma once

#include <filesystem>

namespace tofgraph::io {

/// As long as it lives, others see that the file is being written; a kill ends that too.
class PartFile {
 public:
  /// @param path of a file that is there. @throws std::runtime_error
  explicit PartFile(std::filesystem::path path);
  ~PartFile();
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;

  /// Waits until what was written is on the disk. @throws std::runtime_error
  void sync() const;
  /// Renames it. @param overwrite what has that name by now may be replaced @throws std::runtime_error
  void give_name(const std::filesystem::path& name, bool overwrite) const;

 private:
  std::filesystem::path path_;
  int descriptor_;
};

}  // namespace tofgraph::io
