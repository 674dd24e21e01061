// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The graph: nodes and their inputs, checked as a whole before the first frame.
#pragma once

#include "graph/node.hpp"
#include "graph/pipeline.hpp"
#include "graph/plugin.hpp"
#include "io/camera_folder.hpp"

#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::graph {

struct GraphOptions {
  std::vector<std::filesystem::path> plugin_folders;  ///< complete list: plugin_path()
  std::vector<const Plugin*> own_stages;              ///< built into this program; they take precedence over files
  bool overwrite = false;
  bool other_serial = false;  ///< sets the parameter `other_serial` of every stage that has it
  std::function<void(const std::string& node, const std::string& text, bool warning)> message;
};

class ResolvedPipeline;

class Graph {
 public:
  /// Builds and checks. Errors go to the diagnostics; the graph may run only if there are none.
  Graph(PipelineSpec pipeline, const GraphOptions& options, config::Diagnostics& diagnostics);
  ~Graph();

  /// Nodes in an order in which each follows its inputs; the source is first.
  std::span<const std::unique_ptr<Node>> nodes() const { return nodes_; }
  /// Indices of the nodes that a node reads.
  const std::vector<std::size_t>& inputs(std::size_t node) const { return inputs_[node]; }
  const Queue& queue() const { return queue_; }
  const std::string& name() const { return name_; }
  Host& host() { return host_; }
  /// Folder of the pipeline's camera; null if it has none.
  const io::CameraFolder* camera_folder() const { return camera_ ? camera_->folder.get() : nullptr; }
  /// Nodes inserted for the calibrations of the camera's folder, and calibrations that no node uses.
  const std::vector<std::string>& camera_notes() const { return camera_notes_; }
  /// Renamed channels of the k-th input of a node, for a named port.
  const std::vector<std::pair<std::string, std::string>>& aliases(std::size_t node, std::size_t k) const {
    return aliases_[node][k];
  }
  /// Indices of the nodes that contribute to the frames that reach a node.
  std::set<std::size_t> steps_to(std::size_t node) const;
  /// Processing history of the frames that reach a node, as JSON.
  nlohmann::json provenance(std::size_t node) const;

 private:
  void make_nodes(const ResolvedPipeline& written, const GraphOptions& options, config::Diagnostics& diagnostics);
  void prepare(const GraphOptions& options, config::Diagnostics& diagnostics);
  Stream joined(std::size_t node, config::Diagnostics& diagnostics, bool& right);
  bool join_channel(std::size_t node, std::size_t k, const Channel& channel, Stream& all);
  void tell_collisions(std::size_t node, std::size_t k, const Stream& all, const std::vector<std::string>& names,
                       config::Diagnostics& diagnostics) const;
  bool ports_are_served(std::size_t node, config::Diagnostics& diagnostics) const;

  std::string name_;
  Host host_;
  config::Position camera_at_;
  io::CameraPtr camera_;
  std::vector<std::string> camera_notes_;
  std::vector<std::unique_ptr<Node>> nodes_;
  std::vector<std::vector<std::size_t>> inputs_;
  std::vector<std::vector<InputSpec>> input_specs_;
  std::vector<std::vector<std::vector<std::pair<std::string, std::string>>>> aliases_;  ///< node, input, channels
  std::vector<bool> usable_;                                                            ///< parameters valid, per node
  std::optional<Queue> written_queue_;                                                  ///< queue of the source
  Queue queue_;
};

/// Reads, builds and checks a pipeline file or line. @throws ConfigurationError listing all errors.
std::unique_ptr<Graph> build_graph(const config::Value& document, const std::vector<std::string>& settings,
                                   const GraphOptions& options, config::Diagnostics& diagnostics);

}  // namespace tofgraph::graph
