// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A pipeline described in Python, and its run.
#pragma once

#include "graph/runner.hpp"
#include "python/arrays.hpp"

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace tofgraph::python {

struct OwnStage {
  const graph::Plugin* plugin;
};

/// Description of a pipeline, built in Python.
struct Description {
  std::string text;      ///< file, one-line form or YAML
  bool is_yaml = false;  ///< `text` is the document itself
  std::string camera;    ///< a profile's name or path, or empty
  std::vector<std::string> settings, plugin_folders;
  std::vector<OwnStage> stages;
  bool overwrite = false;
  std::function<void(const std::string&, const std::string&, bool)> message;  ///< node, text, warning
};

/// Counts the calls that wait without the GIL. The GIL guards the counter.
struct Inside {
  Inside() { ++count; }
  ~Inside() { --count; }
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;
  inline static int count = 0;
};

/// Builds and checks. Called without the GIL. @throws config::ConfigurationError
std::unique_ptr<graph::Graph> build(const Description& description, std::vector<std::string>& warnings);

/// Pipeline that runs on its own thread; the frames of one node wait in a queue for Python.
class Run {
 public:
  /// Builds the pipeline and starts it.
  /// @param node whose frames are requested; empty: the last that is not a sink
  /// @param keep_frames false: frames are discarded
  /// @param frames maximum number; 0: all
  /// @param threads that work on frames; 0: one per core
  /// @param capacity frames that may wait for Python
  /// @throws config::ConfigurationError; KeyError, ValueError for a node without frames; SystemExit if another thread
  /// is ending the interpreter
  Run(const Description& description, const std::string& node, bool keep_frames, std::uint64_t frames, unsigned threads,
      std::size_t capacity);
  ~Run() { close(); }
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;

  /// Destroys a run. Inside a callback of a run it does not wait for the end, but leaves that to a separate thread.
  static void discard(Run* run);
  /// Waits, before the interpreter ends, for runs being destroyed, however long their stages take, and at most 2 s for
  /// other threads to leave their calls. The interpreter kills threads still inside a call afterwards, which may end
  /// the program with std::terminate. Other threads can start no further run.
  static void leave_all();

  /// Returns the next frame, or null at the end. @throws std::runtime_error if the run failed
  std::shared_ptr<HeldFrame> next();
  /// Waits for the end. @throws std::runtime_error if the run failed
  void finish();
  /// Ends the run cleanly and drops waiting frames. Inside a callback of a run it does not wait for the end.
  void close();
  /// {frames, dropped, seconds, interrupted, warnings}
  pybind11::dict result() const;
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  /// Number of runs being destroyed by separate threads; guarded by the GIL.
  inline static int discarding_ = 0;
  /// Thread that is ending the interpreter, if any.
  inline static std::thread::id ending_;

  void receive(tofgraph_frame& frame);
  template <class Condition> void wait(const Condition& condition);
  void join();
  void end();

  std::size_t capacity_;
  std::vector<std::string> warnings_;
  std::unique_ptr<graph::Graph> graph_;
  std::unique_ptr<graph::Runner> runner_;
  std::thread thread_;
  mutable std::mutex mutex_;
  std::mutex join_mutex_;
  std::condition_variable changed_;  ///< a frame has arrived, or the run is over
  std::condition_variable room_;     ///< half of the queue is free, or the run is to end
  std::deque<std::shared_ptr<HeldFrame>> queue_;
  graph::RunResult result_;
  bool over_ = false, closing_ = false;
};

}  // namespace tofgraph::python
