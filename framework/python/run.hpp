// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A pipeline that Python describes, and its run.
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

/// A pipeline as Python describes it.
struct Description {
  std::string text;      ///< file, one-line form, or YAML
  bool is_yaml = false;  ///< `text` is the document itself
  std::string camera;    ///< profile's name or path, or empty
  std::vector<std::string> settings, plugin_folders;
  std::vector<OwnStage> stages;
  bool overwrite = false;
  std::function<void(const std::string&, const std::string&, bool)> message;  ///< node, text, warning
};

/// A call that waits without the interpreter's lock, which guards the count.
struct Inside {
  Inside() { ++count; }
  ~Inside() { --count; }
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;
  inline static int count = 0;
};

/// Builds and checks. Called without the interpreter's lock. @throws config::ConfigurationError
std::unique_ptr<graph::Graph> build(const Description& description, std::vector<std::string>& warnings);

/// A pipeline that runs on a thread of its own; frames of one node wait in a queue until Python takes them.
class Run {
 public:
  /// Builds the pipeline and starts it.
  /// @param node whose frames are wanted; empty: the last that is not a sink
  /// @param keep_frames false: no frames are wanted
  /// @param frames maximum number; 0: all
  /// @param threads that work on frames; 0: one per core
  /// @param capacity frames that may wait for Python
  /// @throws config::ConfigurationError; KeyError, ValueError for a node without frames;
  /// SystemExit where another thread ends the interpreter
  Run(const Description& description, const std::string& node, bool keep_frames, std::uint64_t frames, unsigned threads,
      std::size_t capacity);
  ~Run() { close(); }
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;

  /// Destroys a run. Within a call that a run made it does not wait for the end: a thread of its own does.
  static void discard(Run* run);
  /// Waits, before the interpreter ends, for the runs that are still being destroyed, however long their stages take,
  /// and at most 2 s for other threads to leave their calls. The interpreter ends a thread that is within a call after
  /// that wherever it is, which may end the program with std::terminate. Other threads start no run any more.
  static void leave_all();

  /// The next frame, or null at the end. @throws std::runtime_error when the run failed
  std::shared_ptr<HeldFrame> next();
  /// Waits for the end. @throws std::runtime_error when the run failed
  void finish();
  /// Ends the run cleanly; frames that wait are dropped. Does not wait for the end within a call that a run made.
  void close();
  /// {frames, dropped, seconds, interrupted, warnings}
  pybind11::dict result() const;
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  /// Runs that threads of their own destroy; the interpreter's lock guards the number.
  inline static int discarding_ = 0;
  /// The thread that ends the interpreter, once it does.
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
  std::condition_variable changed_;
  std::deque<std::shared_ptr<HeldFrame>> queue_;
  graph::RunResult result_;
  bool over_ = false, closing_ = false;
};

}  // namespace tofgraph::python
