// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Wrapper of HDF5's C interface: self-closing handles, errors as exceptions, one global lock. Internal to this
/// folder.
#pragma once

#include <hdf5.h>

#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>

namespace tofgraph::io::h5 {

/// Lock held during every HDF5 call by all captures of the process, because Debian's HDF5 is not thread-safe.
class Lock {
 public:
  Lock();

 private:
  std::unique_lock<std::mutex> lock_;
};

/// Cause of the last failed call, in plain words. HDF5's messages refer to its internal functions and variables.
struct Failure {
  std::string text;            ///< "it was cut off: it has 600 of 1300 bytes", or the system's error text
  bool being_written = false;  ///< the file is marked as open for writing
};

/// Innermost cause; clears the error stack.
Failure last_failure();
inline std::string last_error() { return last_failure().text; }

/// Owner of an HDF5 identifier.
class Handle {
 public:
  using Close = herr_t (*)(hid_t);
  Handle() = default;
  Handle(hid_t id, Close close) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  ~Handle() { reset(); }
  void reset() {
    if (id_ >= 0) close_(release());
  }
  /// Releases the identifier: the caller closes it.
  hid_t release() { return std::exchange(id_, H5I_INVALID_HID); }
  operator hid_t() const { return id_; }
  explicit operator bool() const { return id_ >= 0; }

 private:
  hid_t id_ = H5I_INVALID_HID;
  Close close_ = nullptr;
};

/// @throws std::runtime_error "WHAT: CAUSE" for a negative result
template <class Result> Result check(Result result, const std::string& what) {
  if (result < 0) throw std::runtime_error(what + ": " + last_error());
  return result;
}

/// Name of the first compression filter of a dataset that this HDF5 lacks, and how to get it; empty: none is missing.
std::string missing_filter(hid_t dataset);

/// HDF5 memory type of an element, for TOFGRAPH_TYPE_F32 and so on.
hid_t memory_type(std::uint32_t element_type);
/// Plugin-interface code of a type in a file; TOFGRAPH_TYPE_ANY if it has none.
std::uint32_t element_type_of(hid_t type);

}  // namespace tofgraph::io::h5
