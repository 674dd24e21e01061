// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Room on the disk for what HDF5 is about to write. For this folder only.
#pragma once

#include <cstdint>
#include <filesystem>

namespace tofgraph::io {

/// HDF5 cannot take back what it has half written when a disk is full. Therefore the room for a frame is reserved
/// before HDF5 hears of it: a frame that does not fit leaves the file as it was.
class DiskSpace {
 public:
  /// @param file that HDF5 writes. @throws std::runtime_error
  explicit DiskSpace(const std::filesystem::path& file);
  ~DiskSpace();
  DiskSpace(const DiskSpace&) = delete;
  DiskSpace& operator=(const DiskSpace&) = delete;

  /// Makes sure that the file can grow by so much. @throws std::runtime_error why it cannot: the disk is full
  void reserve(std::uint64_t bytes);
  /// Gives back what was reserved and not used. For when nothing is written any more.
  void release() noexcept;

 private:
  bool allocate(std::uint64_t bytes);
  std::uint64_t file_size() const;

  int descriptor_ = -1;
  std::uint64_t end_ = 0;  ///< bytes from the file's beginning that are reserved
  bool supported_ = true;  ///< by the file system
};

/// Points HDF5's own descriptor of a file at nothing: what HDF5 still has to write, after a failure, goes nowhere, and
/// the file stays as its last flush has left it. @param descriptor of the file, as HDF5's driver has it
void divert(int descriptor) noexcept;

}  // namespace tofgraph::io
