// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/disk_space.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <stdexcept>
#include <system_error>

namespace tofgraph::io {
namespace {

/// Space reserved at once, so that not every frame needs a call that changes the file's blocks.
constexpr std::uint64_t step = 16U << 20U;  // bytes

[[noreturn]] void refuse(int error) {
  throw std::runtime_error("cannot be written: " + std::generic_category().message(error));
}

}  // namespace

DiskSpace::DiskSpace(const std::filesystem::path& file) : descriptor_(open(file.c_str(), O_WRONLY | O_CLOEXEC)) {
  if (descriptor_ < 0) refuse(errno);
}

DiskSpace::~DiskSpace() {
  release();
  ::close(descriptor_);
}

std::uint64_t DiskSpace::file_size() const {
  struct stat status {};
  if (fstat(descriptor_, &status) != 0) refuse(errno);
  return static_cast<std::uint64_t>(status.st_size);
}

/// @returns false if the disk has too little space
bool DiskSpace::allocate(std::uint64_t bytes) {
  for (;;) {
    if (fallocate(descriptor_, FALLOC_FL_KEEP_SIZE, static_cast<off_t>(end_), static_cast<off_t>(bytes)) == 0) break;
    if (errno == EINTR) continue;
    if (errno == ENOSPC || errno == EDQUOT) return false;
    if (errno != EOPNOTSUPP && errno != ENOSYS) refuse(errno);
    supported_ = false;
    return true;
  }
  end_ += bytes;
  return true;
}

void DiskSpace::reserve(std::uint64_t bytes) {
  const std::uint64_t needed = file_size() + bytes;
  if (supported_) {
    if (needed <= end_) return;
    end_ = std::max(end_, needed - bytes);
    const std::uint64_t missing = needed - end_;
    if (!allocate(std::max(step, missing)) && !allocate(missing)) refuse(ENOSPC);
    if (supported_) return;
  }
  struct statvfs disk {};
  if (fstatvfs(descriptor_, &disk) == 0 && disk.f_blocks != 0 && disk.f_bavail * disk.f_frsize < bytes) refuse(ENOSPC);
}

void DiskSpace::release() noexcept {
  struct stat status {};
  // Truncating to the current size releases the reservation.
  if (supported_ && end_ != 0 && fstat(descriptor_, &status) == 0 &&
      static_cast<std::uint64_t>(status.st_size) < end_ && ftruncate(descriptor_, status.st_size) == 0)
    end_ = 0;
}

void divert(int descriptor) noexcept {
  const int nothing = memfd_create("tofgraph", MFD_CLOEXEC);
  if (nothing < 0) return;
  dup3(nothing, descriptor, O_CLOEXEC);
  ::close(nothing);
}

}  // namespace tofgraph::io
