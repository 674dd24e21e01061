// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Numeric arrays of HDF5 files of other programs.
#pragma once

#include <tofgraph/file_format.hpp>

#include <filesystem>
#include <memory>
#include <vector>

namespace tofgraph::io {

/// Datasets of integers or floating-point numbers with one to five dimensions, named by their paths in the file
/// ("camera/depth"). Others (texts, compounds, scalars, linked files) are ignored.
class ArrayFile {
 public:
  /// Opens the file after a child process has read the first and last slice of each array without crashing.
  /// @throws std::runtime_error if it is damaged, has no such array or is a capture; ends a sentence about the file
  explicit ArrayFile(const std::filesystem::path& file);
  ~ArrayFile();
  ArrayFile(const ArrayFile&) = delete;
  ArrayFile& operator=(const ArrayFile&) = delete;

  const std::vector<FileArray>& arrays() const;
  /// Reads elements first .. first + count - 1 along the slowest axis of an array, in native byte order.
  /// @throws std::runtime_error
  void read(std::size_t array, std::uint64_t first, std::uint64_t count, void* out) const;
  /// Reads a file for trial in a separate process, which is limited in memory and time from then on.
  static void read_on_trial(const std::filesystem::path& file);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tofgraph::io
