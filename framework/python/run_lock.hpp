// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The interpreter's lock for calls that a run makes into Python.
#pragma once

#include <pybind11/pybind11.h>

namespace tofgraph::python {

/// Holds the interpreter's lock while a thread of a run is in Python. The garbage that Python collects meanwhile may be
/// the run itself, which cannot wait for its own end there: see Run::close.
class RunLock {
 public:
  RunLock() { ++depth; }
  ~RunLock() { --depth; }
  RunLock(const RunLock&) = delete;
  RunLock& operator=(const RunLock&) = delete;
  /// Returns true within a call that a run made.
  static bool held() { return depth > 0; }

 private:
  inline static thread_local int depth = 0;
  pybind11::gil_scoped_acquire lock_;
};

}  // namespace tofgraph::python
