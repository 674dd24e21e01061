// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Adapts a pipeline to one condition of a campaign: other inputs and outputs, and a recorder.
#pragma once

#include "graph/graph.hpp"
#include "io/condition.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::cli {

/// Name of a condition's folder: letters, digits and -_. of its id.
std::string folder_name(const std::string& id);

class CampaignPipeline {
 public:
  /// @param pipeline as written @param out folder of all results
  /// @throws config::ConfigurationError if there is no source that reads captures
  CampaignPipeline(graph::PipelineSpec pipeline, std::filesystem::path out,
                   const std::vector<std::filesystem::path>& plugin_folders);

  /// Pipeline for one condition: reads its capture and frames, writes below its folder.
  graph::PipelineSpec of(const io::Condition& condition) const;

  /// Adds a recorder behind the last node that outputs length images. @returns whether there is such a node
  bool add_recorder(const graph::Graph& graph);

 private:
  /// Node whose frames can be recorded and measured, and the channels to record.
  struct Recordable {
    std::string node;
    std::vector<std::string> channels;
  };
  std::vector<std::string> output_keys(const std::string& stage) const;
  graph::NodeSpec recorder(const std::filesystem::path& folder) const;

  graph::PipelineSpec pipeline_;
  std::filesystem::path out_;
  graph::PluginRegistry registry_;
  std::size_t source_ = 0;  ///< node that reads the captures
  std::optional<Recordable> recorded_;
};

}  // namespace tofgraph::cli
