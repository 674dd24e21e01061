// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// For programs that run a pipeline themselves. Link libtofgraph; for PCL clouds also include tofgraph/pcl.hpp.
///
///     tofgraph::Pipeline pipeline("board.yaml");
///     pipeline.set("correct.solver", "newton");
///     pipeline.on_frame("cloud", [](const tofgraph::Frame& frame) { show(tofgraph::to_pcl(frame)); });
///     pipeline.run();
#pragma once

#include <tofgraph/frame.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace tofgraph {

class Pipeline {
 public:
  /// Result of a run.
  struct Result {
    std::uint64_t frames = 0;   ///< completed
    std::uint64_t dropped = 0;  ///< at the source's output, if its queue is set to drop_oldest
    double seconds = 0;
    bool interrupted = false;  ///< by stop()
  };

  /// @param pipeline a file, or the one-line form "reader file=a.h5 ! decoder ! writer path=b.pcd"
  /// @param camera a profile's name or path; empty: the pipeline's
  explicit Pipeline(std::string pipeline, std::string camera = {});
  ~Pipeline();

  /// Replaces a parameter, like --set: set("denoise.strength", "3.91 mm").
  void set(const std::string& parameter, const std::string& value);
  /// Sets plugin folders to search before TOFGRAPH_PLUGIN_PATH and the installed folder.
  void plugin_path(const std::vector<std::string>& folders);
  /// Allows existing outputs to be replaced; default false.
  void overwrite(bool allowed);
  /// Calls a function with each frame that leaves a node, in order, on a thread of the run. Views live during the call.
  void on_frame(const std::string& node, std::function<void(const Frame&)> receive);

  /// Checks without running. @throws std::runtime_error whose text lists all errors with their positions
  void check();
  /// @param frames maximum number; 0: all. @param threads that work on frames; 0: one per core
  /// @throws std::runtime_error as check(), or with node, frame and reason if the run fails; files are then closed
  Result run(std::uint64_t frames = 0, unsigned threads = 0);
  /// Ends a run cleanly. [any thread]
  void stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tofgraph
