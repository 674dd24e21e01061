// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/resolved_pipeline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <set>

namespace tofgraph::graph {
namespace {

const Plugin* find_stage(const NodeSpec& node, const PluginRegistry& registry, config::Diagnostics& diagnostics) {
  if (node.stage.empty()) return nullptr;
  const PluginFile* file = registry.find(node.stage);
  if (file == nullptr || !file->is_stage()) {
    const std::string what = file != nullptr
                                 ? fmt::format("'{}' is {}, not a stage", node.stage,
                                               file->kind == "effect" ? "an effect of the simulator" : "a file format")
                                 : fmt::format("there is no stage '{}'", node.stage);
    diagnostics.error(node.stage_at, what, config::suggestion(node.stage, registry.names(), "stages"));
    return nullptr;
  }
  try {
    return &registry.load(*file);
  } catch (const PluginError& error) {
    diagnostics.error(node.stage_at, error.what());
    return nullptr;
  }
}

}  // namespace

ResolvedPipeline::ResolvedPipeline(const PipelineSpec& pipeline, const PluginRegistry& registry,
                                   config::Diagnostics& diagnostics)
    : specs_(pipeline.nodes) {
  for (const NodeSpec& node : specs_) {
    stages_.push_back(find_stage(node, registry, diagnostics));
    names_.push_back(node.name);
  }
  for (std::size_t i = 0; i < specs_.size(); ++i) inputs_.push_back(resolved_inputs(i, diagnostics));
  check_sources(diagnostics);
}

std::size_t ResolvedPipeline::index_of(const std::string& name) const {
  return static_cast<std::size_t>(std::ranges::find(names_, name) - names_.begin());
}

bool ResolvedPipeline::is(std::size_t node, std::string_view kind) const {
  return stages_[node] != nullptr && kind == stages_[node]->kind;
}

void ResolvedPipeline::check_sources(config::Diagnostics& diagnostics) const {
  std::size_t sources = 0;
  for (std::size_t i = 0; i < specs_.size(); ++i) {
    const NodeSpec& node = specs_[i];
    if (node.queue && stages_[i] != nullptr && !is(i, "source")) {
      diagnostics.error(
          node.queue->at, fmt::format("node '{}' is not a source: only a source has a queue", node.name),
          "frames are dropped only at the source's exit, so that no branch waits for a frame that another one lost");
    }
    if (!is(i, "source")) continue;
    if (node.inputs)
      diagnostics.error(node.at, fmt::format("node '{}' ({}) is a source and takes no inputs", node.name, node.stage));
    if (++sources > 1)
      diagnostics.error(node.at, fmt::format("node '{}' is a second source; a pipeline has one", node.name));
  }
  const bool all_known = std::ranges::all_of(stages_, [](auto* stage) { return stage != nullptr; });
  if (sources == 0 && all_known && !specs_.empty()) {
    diagnostics.error(specs_.front().at, "the pipeline has no source",
                      specs_.front().at.one_line()
                          ? "example: capture_reader file=recording.h5 ! ..."
                          : "example: - {name: grab, stage: capture_reader, file: recording.h5}");
  }
}

/// Inputs as written, or the nearest preceding node that outputs frames; names of unknown nodes are omitted.
std::vector<InputSpec> ResolvedPipeline::resolved_inputs(std::size_t i, config::Diagnostics& diagnostics) const {
  const NodeSpec& node = specs_[i];
  if (is(i, "source")) return {};
  std::vector<InputSpec> inputs = node.inputs.value_or(std::vector<InputSpec>{});
  if (!node.inputs) {
    for (std::size_t k = i; k-- > 0 && inputs.empty();) {
      if (!is(k, "sink")) inputs.push_back({"", specs_[k].name, node.at});
    }
    if (inputs.empty() && stages_[i] != nullptr) {
      diagnostics.error(
          node.at, fmt::format("node '{}' has nothing to read: no node above it outputs frames", node.name),
          node.at.one_line() ? "the first stage is a source, e.g. capture_reader file=recording.h5 ! ..."
                             : "the first node is a source, e.g. {stage: capture_reader, file: recording.h5}");
    }
  }
  for (const InputSpec& input : inputs) {
    const std::size_t k = index_of(input.node);
    if (k == specs_.size())
      diagnostics.error(input.at, fmt::format("node '{}' reads '{}', which is not a node", node.name, input.node),
                        config::suggestion(input.node, names_, "nodes"));
    else if (is(k, "sink"))
      diagnostics.error(
          input.at, fmt::format("node '{}' reads '{}', which is a sink and outputs nothing", node.name, input.node));
  }
  std::erase_if(inputs, [&](const InputSpec& input) { return index_of(input.node) == specs_.size(); });
  return inputs;
}

std::vector<std::size_t> ResolvedPipeline::order(config::Diagnostics& diagnostics) const {
  std::vector<std::size_t> order;
  std::vector<bool> placed(specs_.size());
  for (bool moved = true; moved;) {
    moved = false;
    for (std::size_t i = 0; i < specs_.size(); ++i) {
      const bool ready =
          std::ranges::all_of(inputs_[i], [&](const InputSpec& input) { return placed[index_of(input.node)]; });
      if (placed[i] || !ready || stages_[i] == nullptr) continue;
      order.push_back(i);
      moved = placed[i] = true;
    }
  }
  for (std::size_t i = 0; i < specs_.size(); ++i) {
    if (!waits_for_itself(i)) continue;
    diagnostics.error(specs_[i].at,
                      fmt::format("node '{}' is part of a cycle: it waits for its own result", specs_[i].name),
                      "change its inputs");
  }
  return order;
}

/// Returns whether a node depends on itself. A dependence on an unknown node has already been reported.
bool ResolvedPipeline::waits_for_itself(std::size_t node) const {
  std::set<std::size_t> seen;
  std::deque<std::size_t> open = {node};
  while (!open.empty()) {
    for (const InputSpec& input : inputs_[open.front()]) {
      const std::size_t k = index_of(input.node);
      if (k == node) return true;
      if (seen.insert(k).second) open.push_back(k);
    }
    open.pop_front();
  }
  return false;
}

}  // namespace tofgraph::graph
