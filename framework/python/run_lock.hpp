// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The GIL for calls of a run into Python.
#pragma once

#include <pybind11/pybind11.h>

#include <mutex>
#include <set>
#include <vector>

namespace tofgraph::python {

/// Python's thread state for a thread of a run. It lives as long as the thread, since creating one per call would cost
/// two system calls and their page faults. A terminating thread leaves its state to be deleted by the next thread that
/// holds the GIL, and does not wait for the GIL itself: the interpreter may be ending.
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
  /// Keeps the state created by the lock. Requires the GIL.
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
    static Left* const list = new Left;  // never destroyed: threads may outlive static objects
    return *list;
  }
  PyThreadState* state_ = nullptr;
};

/// Holds the GIL while a thread of a run is in Python. Python may meanwhile garbage-collect the run itself, which then
/// must not wait for its own end: see Run::close.
class RunLock {
 public:
  RunLock() {
    if (depth++ == 0) inside_.insert(PyThread_get_thread_ident());
    if (is_new_) state.keep(lock_);
  }
  ~RunLock() {
    if (--depth > 0) return;
    if (interrupted_) PyThreadState_SetAsyncExc(PyThread_get_thread_ident(), nullptr);  // not in its next call
    inside_.erase(PyThread_get_thread_ident());
  }
  RunLock(const RunLock&) = delete;
  RunLock& operator=(const RunLock&) = delete;
  /// Returns true inside a callback of a run.
  static bool held() { return depth > 0; }
  /// Raises KeyboardInterrupt in all threads that are inside a callback, e.g. a stage that never returns: Ctrl-C
  /// reaches only Python's main thread. Requires the GIL.
  static void interrupt() {
    interrupted_ = true;
    for (const unsigned long thread : inside_) PyThreadState_SetAsyncExc(thread, PyExc_KeyboardInterrupt);
  }

 private:
  inline static thread_local int depth = 0;
  inline static thread_local ThreadState state;
  inline static std::set<unsigned long> inside_;  ///< threads by Python's number; guarded by the GIL
  inline static bool interrupted_ = false;
  bool is_new_ =
      PyGILState_GetThisThreadState() == nullptr;  ///< the thread is not Python's, and enters for the first time
  pybind11::gil_scoped_acquire lock_;
};

}  // namespace tofgraph::python
