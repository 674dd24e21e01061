// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/untrusted.hpp"
#include "cli/watch.hpp"
#include "config/process_limits.hpp"
#include "config/quantity.hpp"
#include "graph/plugin.hpp"
#include "io/output_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <mutex>

namespace tofgraph::cli {
namespace {

/// Returns whether a path lies in a folder without symbolic links below it: a link may point anywhere, also to a file
/// that an earlier node has yet to create.
bool lies_in(const std::filesystem::path& path, const std::filesystem::path& folder) {
  const std::filesystem::path outer = std::filesystem::absolute(folder / "").lexically_normal().parent_path(),
                              inner = std::filesystem::absolute(path).lexically_normal();
  const auto [rest, below] = std::ranges::mismatch(outer, inner);
  if (rest != outer.end()) return false;
  std::filesystem::path part = outer;
  return std::none_of(below, inner.end(), [&part](const std::filesystem::path& name) {
    std::error_code error;
    return std::filesystem::is_symlink(part /= name, error);
  });
}

}  // namespace

void restrict_process(const UntrustedLimits& limits) {
  graph::use_built_in_plugins_only();
  config::limit_process({.memory = limits.memory});
}

void refuse_reach(const config::Value& pipeline) {
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
    const config::Entry* overwrite = node.find("overwrite");
    if (overwrite != nullptr && overwrite->value.text != "false")
      diagnostics.error(overwrite->at, "--untrusted does not allow a pipeline to replace files by itself",
                        "take it out; --force on the command line replaces existing outputs");
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

TimeLimit::TimeLimit(double limit)
    : thread_([this, limit](const std::stop_token& stop) {
        constexpr double grace = 10;  // s
        std::mutex mutex;
        std::condition_variable_any ended;
        std::unique_lock lock(mutex);
        const auto passes = [&](double seconds) {
          return !ended.wait_for(lock, stop, std::chrono::duration<double>(seconds), [] { return false; }) &&
                 !stop.stop_requested();
        };
        if (!passes(limit)) return;
        reached_ = true;
        signals = 1;
        if (!passes(grace)) return;
        print_message(
            fmt::format("error: the run did not end within {} after its limit of {}: ended at once, its outputs "
                        "may be incomplete",
                        config::format_quantity(grace, "s"), config::format_quantity(limit, "s")));
        syscall(SYS_exit_group, 1);
      }) {}

}  // namespace tofgraph::cli
