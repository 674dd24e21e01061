// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Declarations of the stages on the search path, for advice on which stage provides a missing channel.
#pragma once

#include "graph/pipeline.hpp"
#include "graph/plugin.hpp"
#include "graph/stream.hpp"

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::graph {

/// Descriptors are read at the first query: a graph without errors makes none.
class KnownStages {
 public:
  /// Both must outlive this object. @param nodes of the pipeline: a stage in use is named by its node
  KnownStages(const PluginRegistry& registry, const std::vector<NodeSpec>& nodes)
      : registry_(registry), nodes_(nodes) {}

  /// Stages to insert before a node of this stage to obtain one of these channels; empty if there are none.
  std::string way_to(const std::vector<std::string>& channels, const Stream& stream, const std::string& stage) const;
  /// Words that a stage adds to the history of its outputs; none for an unknown stage.
  std::vector<std::string> added_by(const std::string& stage) const;

 private:
  struct Step {
    std::string stage;
    std::vector<std::string> makes;
    std::vector<std::vector<std::string>> reads;  ///< alternatives of each required port
    std::vector<std::string> adds;
  };
  using Names = std::vector<std::string>;

  const std::vector<Step>& steps() const;
  std::string named(const Names& stages) const;
  Names missing_for(const Names& stages, const Names& have) const;
  Names makers_of(const Names& channels, const Names& have, const std::string& except) const;

  const PluginRegistry& registry_;
  const std::vector<NodeSpec>& nodes_;
  mutable std::optional<std::vector<Step>> steps_;
};

}  // namespace tofgraph::graph
