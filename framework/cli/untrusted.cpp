// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/untrusted.hpp"
#include "config/process_limits.hpp"
#include "graph/plugin.hpp"
#include "io/output_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace tofgraph::cli {
namespace {

/// Returns whether a path lies in a folder; both may contain links, and need not exist.
bool lies_in(const std::filesystem::path& path, const std::filesystem::path& folder) {
  const std::filesystem::path inner = std::filesystem::weakly_canonical(path),
                              outer = std::filesystem::weakly_canonical(folder);
  return std::ranges::mismatch(outer, inner).in1 == outer.end();
}

}  // namespace

void restrict_process(const UntrustedLimits& limits) {
  graph::use_built_in_plugins_only();
  config::limit_process({.memory = limits.memory});
}

void refuse_devices(const config::Value& pipeline) {
  constexpr std::array<std::string_view, 2> reach_beyond_files = {"camcube", "live_view"};
  config::Diagnostics diagnostics;
  const config::Entry* nodes = pipeline.find("nodes");
  for (const config::Value& node : nodes == nullptr ? std::vector<config::Value>{} : nodes->value.items) {
    const config::Entry* stage = node.find("stage");
    if (stage != nullptr && std::ranges::find(reach_beyond_files, stage->value.text) != reach_beyond_files.end())
      diagnostics.error(
          stage->value.at,
          fmt::format("'{}' opens a device or a network port, which --untrusted does not allow", stage->value.text),
          "if you trust the pipeline, run it without --untrusted");
  }
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
}

void refuse_outputs_outside(const graph::Graph& graph, const std::filesystem::path& folder) {
  for (const auto& node : graph.nodes()) {
    for (const io::OutputPattern& pattern : node->outputs()) {
      if (!pattern.text().empty() && !lies_in(pattern.folder(), folder))
        throw config::ConfigurationError(
            fmt::format("node '{}': error: writes {}, outside of {}: --untrusted does not allow that\n"
                        "         a path in the pipeline's own folder, e.g. path: out/cloud.pcd",
                        node->name, pattern.text(), std::filesystem::weakly_canonical(folder).string()));
    }
  }
}

TimeLimit::TimeLimit(graph::Runner& runner, std::chrono::seconds limit)
    : thread_([this, &runner, limit] {
        std::unique_lock lock(mutex_);
        if (ended_.wait_for(lock, limit, [this] { return over_; })) return;
        reached_ = true;
        runner.stop();
      }) {}

TimeLimit::~TimeLimit() {
  {
    const std::scoped_lock lock(mutex_);
    over_ = true;
  }
  ended_.notify_all();
  thread_.join();
}

bool TimeLimit::reached() const {
  const std::scoped_lock lock(mutex_);
  return reached_;
}

}  // namespace tofgraph::cli
