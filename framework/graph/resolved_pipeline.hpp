// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The nodes as written, with their stages and inputs, before any is created.
#pragma once

#include "graph/pipeline.hpp"
#include "graph/plugin.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace tofgraph::graph {

class ResolvedPipeline {
 public:
  /// Finds the stages and resolves the inputs. Errors go to the diagnostics; invalid nodes are omitted.
  ResolvedPipeline(const PipelineSpec& pipeline, const PluginRegistry& registry, config::Diagnostics& diagnostics);

  /// Indices of the nodes with a known stage, each after its inputs. Reports circular dependencies.
  std::vector<std::size_t> order(config::Diagnostics& diagnostics) const;

  const NodeSpec& spec(std::size_t node) const { return specs_[node]; }
  const Plugin* stage(std::size_t node) const { return stages_[node]; }  ///< null: unknown
  const std::vector<InputSpec>& inputs(std::size_t node) const { return inputs_[node]; }
  /// Index of a name; the number of nodes if there is no such name.
  std::size_t index_of(const std::string& name) const;

 private:
  bool is(std::size_t node, std::string_view kind) const;
  void check_sources(config::Diagnostics& diagnostics) const;
  std::vector<InputSpec> resolved_inputs(std::size_t node, config::Diagnostics& diagnostics) const;
  bool waits_for_itself(std::size_t node) const;

  const std::vector<NodeSpec>& specs_;
  std::vector<std::string> names_;
  std::vector<const Plugin*> stages_;
  std::vector<std::vector<InputSpec>> inputs_;
};

}  // namespace tofgraph::graph
