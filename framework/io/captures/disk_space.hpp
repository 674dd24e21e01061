// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Disk space reserved for HDF5's writes. Internal to this folder.
#pragma once

#include <cstdint>
#include <filesystem>

namespace tofgraph::io {

/// Reservation of disk space. HDF5 cannot undo a partial write on a full disk, so the space for a frame is reserved
/// before HDF5 writes: a frame that does not fit leaves the file unchanged.
class DiskSpace {
 public:
  /// @param file file that HDF5 writes. @throws std::runtime_error
  explicit DiskSpace(const std::filesystem::path& file);
  ~DiskSpace();
  DiskSpace(const DiskSpace&) = delete;
  DiskSpace& operator=(const DiskSpace&) = delete;

  /// Ensures that the file can grow by this many bytes. @throws std::runtime_error if it cannot: the disk is full
  void reserve(std::uint64_t bytes);
  /// Releases unused space. Call it after the last write.
  void release() noexcept;

 private:
  bool allocate(std::uint64_t bytes);
  std::uint64_t file_size() const;

  int descriptor_ = -1;
  std::uint64_t end_ = 0;  ///< reserved bytes, counted from the beginning of the file
  bool supported_ = true;  ///< by the file system
};

/// Redirects HDF5's descriptor of a file after a failure, so that pending writes of HDF5 are discarded and the file
/// stays as of its last flush. @param descriptor of the file, from HDF5's driver
void divert(int descriptor) noexcept;

}  // namespace tofgraph::io
