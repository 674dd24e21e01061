// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A node: one stage of the graph, its contract kept from both sides.
#pragma once

#include "core/document.hpp"
#include "core/frame.hpp"
#include "core/parameters.hpp"
#include "core/stream.hpp"

#include <tofgraph/plugin.h>

#include <atomic>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace tofgraph::core {

/// What the nodes of a graph share with their host.
struct NodeHost {
  bool overwrite = false;
  std::atomic<bool> stopping{false};
  std::function<void(const std::string& node, const std::string& text, bool warning)> message;
  std::string version;
};

/// A file that shaped a result.
struct UsedFile {
  std::string path, sha256;  ///< sha256 empty: the file is too large to read it for that
};

class Node {
 public:
  Node(std::size_t index, std::string name, Position at, const tofgraph_descriptor& stage, ParameterValues values,
       NodeHost& host);
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  /// Makes the stage and asks it what leaves. Mistakes go to the diagnostics, with their place.
  bool create(Diagnostics& diagnostics);
  bool prepare(const std::vector<const Stream*>& inputs, const std::vector<std::string>& input_names,
               Diagnostics& diagnostics);

  /// Runs the stage on one frame. @returns false when nothing leaves: a source has no more. @throws std::runtime_error
  /// what went wrong, a frame that is not as announced included.
  bool process(tofgraph_frame* const* frames, std::size_t count);
  void finish();  ///< @throws std::runtime_error
  void stop();

  bool is_source() const { return kind_is("source"); }
  bool is_sink() const { return kind_is("sink"); }
  bool stateless() const { return (stage_.flags & TOFGRAPH_STATELESS) != 0; }
  bool many_inputs() const { return (stage_.flags & TOFGRAPH_MANY_INPUTS) != 0; }

  const std::size_t index;
  const std::string name;
  const Position at;
  const tofgraph_descriptor& stage() const { return stage_; }
  const ParameterValues& values() const { return values_; }
  const Stream& output() const { return output_; }
  const std::vector<UsedFile>& files() const { return files_; }
  /// The stage itself, for embedders' own stages.
  void set_provenance(std::string json) { provenance_ = std::move(json); }

 private:
  friend struct HostCalls;
  struct BorderStream;

  bool kind_is(std::string_view kind) const { return kind == stage_.kind; }
  bool bind(const Stream& stream, std::vector<const Channel*>& bound, Diagnostics& diagnostics) const;
  bool check_input(const Stream& stream, const tofgraph_port& port, const Channel& channel,
                   Diagnostics& diagnostics) const;
  void announce_outputs(const std::vector<const Channel*>& bound);
  bool check_outputs(const Stream& input, const std::vector<const Channel*>& bound, Diagnostics& diagnostics) const;
  std::vector<std::string> names_made() const;
  std::string without_recorded(const Stream& stream, const std::vector<std::string>& unwanted) const;
  Channel output_channel(const tofgraph_port& port) const;
  void announce_rays();
  void verify(const tofgraph_frame& frame) const;
  [[noreturn]] void fail(const char* otherwise) const;

  const tofgraph_descriptor& stage_;
  ParameterValues values_;
  NodeHost& host_;
  void* self_ = nullptr;
  Stream output_;
  std::vector<UsedFile> files_;
  std::string provenance_;
  Diagnostics* preparing_ = nullptr;
  tofgraph_stream* arriving_ = nullptr;  ///< during prepare: what a source is shown, with its camera once it chose one
  CameraPtr own_camera_;                 ///< when this node changed it
};

}  // namespace tofgraph::core
