// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/part_file.hpp"

#include "io/captures/capture.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <stdexcept>
#include <system_error>

namespace tofgraph::io {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void fail(const std::string& what) { throw std::runtime_error(what); }
std::string reason(int error) { return std::generic_category().message(error); }

/// Lock on the whole file. A different kind from HDF5's locks, which would exclude readers.
struct flock whole_file(short kind) {
  struct flock lock {};
  lock.l_type = kind;
  lock.l_whence = SEEK_SET;
  return lock;
}

/// @returns errno, or 0
int rename_to_new(const fs::path& from, const fs::path& to) {
  if (renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return errno;
  std::error_code error;  // no support by the file system
  if (fs::exists(fs::symlink_status(to, error))) return EEXIST;
  return rename(from.c_str(), to.c_str()) == 0 ? 0 : errno;
}

}  // namespace

PartFile::PartFile(fs::path path) : path_(std::move(path)), descriptor_(open(path_.c_str(), O_RDWR | O_CLOEXEC)) {
  if (descriptor_ < 0) fail("cannot be opened: " + reason(errno));
  // Shared, because on network file systems, where all kinds of locks are one, an exclusive lock would exclude readers.
  // Without lock support recording continues, without a warning to other programs.
  struct flock mark = whole_file(F_RDLCK);
  static_cast<void>(fcntl(descriptor_, F_OFD_SETLK, &mark));
}

PartFile::~PartFile() { ::close(descriptor_); }

void PartFile::sync() const {
  if (fsync(descriptor_) != 0 && errno != EINVAL && errno != ENOTSUP) fail("cannot be written: " + reason(errno));
}

void PartFile::give_name(const fs::path& name, bool overwrite) const {
  const int error = overwrite ? (rename(path_.c_str(), name.c_str()) == 0 ? 0 : errno) : rename_to_new(path_, name);
  if (error == EEXIST)
    fail(
        fmt::format("is complete, but {} was made by somebody else meanwhile: it is not replaced; 'tofgraph repair {} "
                    "-o OTHER.h5' makes a capture of the recording",
                    name.string(), path_.string()));
  if (error != 0) fail("cannot be renamed: " + reason(error));
}

bool CaptureWriter::is_at_work(const fs::path& part) {
  const int descriptor = open(part.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return false;
  struct flock found = whole_file(F_WRLCK);
  const bool known = fcntl(descriptor, F_OFD_GETLK, &found) == 0;
  ::close(descriptor);
  return known && found.l_type != F_UNLCK;
}

}  // namespace tofgraph::io
