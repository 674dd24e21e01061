// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file HDF5's C interface made safe: handles that close, errors that are exceptions, one lock. For this folder
/// only.
#pragma once

#include <hdf5.h>

#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>

namespace tofgraph::io::h5 {

/// Debian's HDF5 is not thread-safe: every call is made while this is held, by all captures of the process.
class Lock {
 public:
  Lock();

 private:
  std::unique_lock<std::mutex> lock_;
};

/// Cause of the last failed call, in plain words. HDF5's own name functions and variables of the library.
struct Failure {
  std::string text;            ///< "it was cut off: it has 600 of 1300 bytes", or what the system says
  bool being_written = false;  ///< the file is marked as open for writing
};

/// The innermost cause; clears the stack.
Failure last_failure();
inline std::string last_error() { return last_failure().text; }

/// An identifier that is given back.
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
  /// Hands the identifier out: the caller closes it.
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

/// Names the first compression filter of a dataset that this HDF5 does not have, and what to do; empty: all are there.
std::string missing_filter(hid_t dataset);

/// HDF5's type of an element in memory; for TOFGRAPH_TYPE_F32 and so on.
hid_t memory_type(std::uint32_t element_type);
/// The border's code of a type in a file, TOFGRAPH_TYPE_ANY for what has none.
std::uint32_t element_type_of(hid_t type);

}  // namespace tofgraph::io::h5
