// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The interpreter's lock for calls that a run makes into Python.
#pragma once

#include <pybind11/pybind11.h>

#include <mutex>
#include <vector>

namespace tofgraph::python {

/// Python's state of a thread of a run. It lives as long as the thread: to make one for each call would cost two system
/// calls and their page faults. A thread that ends leaves it to the next one that has the interpreter's lock, and does
/// not wait for that: the interpreter may be ending.
class ThreadState {
 public:
  ThreadState() = default;
  ThreadState(const ThreadState&) = delete;
  ThreadState& operator=(const ThreadState&) = delete;
  ~ThreadState() {
    if (state_ == nullptr) return;
    const std::scoped_lock lock(left().mutex);
    left().states.push_back(state_);
  }
  /// Keeps the state that the lock made. Under the interpreter's lock.
  void keep(pybind11::gil_scoped_acquire& lock) {
    lock.inc_ref();
    state_ = PyThreadState_Get();
    std::vector<PyThreadState*> states;
    {
      const std::scoped_lock of_list(left().mutex);
      states.swap(left().states);
    }
    for (PyThreadState* state : states) {
      PyThreadState_Clear(state);
      PyThreadState_Delete(state);
    }
  }

 private:
  struct Left {
    std::mutex mutex;
    std::vector<PyThreadState*> states;
  };
  static Left& left() {
    static Left* const list = new Left;  // threads may end later than the program's objects
    return *list;
  }
  PyThreadState* state_ = nullptr;
};

/// Holds the interpreter's lock while a thread of a run is in Python. The garbage that Python collects meanwhile may be
/// the run itself, which cannot wait for its own end there: see Run::close.
class RunLock {
 public:
  RunLock() {
    ++depth;
    if (is_new_) state.keep(lock_);
  }
  ~RunLock() { --depth; }
  RunLock(const RunLock&) = delete;
  RunLock& operator=(const RunLock&) = delete;
  /// Returns true within a call that a run made.
  static bool held() { return depth > 0; }

 private:
  inline static thread_local int depth = 0;
  inline static thread_local ThreadState state;
  bool is_new_ =
      PyGILState_GetThisThreadState() == nullptr;  ///< the thread is not of Python, and here for the first time
  pybind11::gil_scoped_acquire lock_;
};

}  // namespace tofgraph::python
