// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Numeric arrays of an HDF5 file written by another program.
#pragma once

#include <tofgraph/file_format.hpp>

#include <filesystem>
#include <memory>
#include <vector>

namespace tofgraph::io {

/// Datasets of integers or floating-point numbers with one to five dimensions, under their paths in the file
/// ("camera/depth"). Others (texts, compounds, scalars, those in other files) are ignored. Datasets with the netCDF
/// (CF) attributes scale_factor, add_offset, _FillValue or missing_value are unpacked to float64, fill values to NaN.
class ArrayFile {
 public:
  /// Opens the file after a child process has read the ends of each array.
  /// @throws std::runtime_error with the end of a sentence about the file: damaged, no such array, a capture
  explicit ArrayFile(const std::filesystem::path& file);
  ~ArrayFile();
  ArrayFile(const ArrayFile&) = delete;
  ArrayFile& operator=(const ArrayFile&) = delete;

  const std::vector<FileArray>& arrays() const;
  /// Reads elements first .. first + count - 1 along the slowest axis of an array, in native byte order.
  /// @throws std::runtime_error
  void read(std::size_t array, std::uint64_t first, std::uint64_t count, void* out) const;
  /// Reads a file on trial in a separate process, whose memory and processor time are limited from then on.
  static void read_on_trial(const std::filesystem::path& file);

 private:
  struct Packing;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tofgraph::io
