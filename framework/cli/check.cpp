// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/commands.hpp"

#include "io/profile.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

namespace tofgraph::cli {
namespace {

/// Checks a file by the kind that its first key names.
int check(const PipelineArguments& arguments, const Common& common) {
  const core::Value document = arguments.document();
  if (document.find("profile") != nullptr && document.find("pipeline") == nullptr) {
    core::Diagnostics diagnostics;
    const auto camera = io::read_profile(document, diagnostics);
    if (!camera) throw core::ConfigurationError(diagnostics);
    if (!common.quiet) say(fmt::format("{}: the profile is right", arguments.pipeline));
    return done;
  }
  // Existing outputs are a matter of the run, not of the pipeline.
  const auto graph = build(document, arguments, common, true);
  if (!common.quiet) say(fmt::format("{}: the pipeline is right, {} nodes", arguments.pipeline, graph->nodes().size()));
  return done;
}

}  // namespace

void add_check(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<PipelineArguments>();
  CLI::App* command = app.add_subcommand("check", "Say every mistake in a pipeline or profile, run nothing");
  arguments->add_to(*command);
  command->callback(
      [arguments, &common] { common.command = [arguments, &common] { return check(*arguments, common); }; });
}

}  // namespace tofgraph::cli
