// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/explain.hpp"
#include "graph/checking.hpp"

#include "cli/commands.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

namespace tofgraph::cli {

void add_explain(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<PipelineArguments>();
  auto drawing = std::make_shared<bool>(false);
  CLI::App* command = app.add_subcommand("explain", "Show how each stage changes the channels");
  command->footer("Example: tofgraph explain pipelines/quickstart.yaml --dot > graph.dot");
  arguments->add_to(*command);
  command->add_flag("--dot", *drawing, "Print the graph in the DOT language instead");
  command->callback([arguments, drawing, &common] {
    common.command = [arguments, drawing, &common] {
      graph::set_only_checking();
      const auto graph = build(arguments->document(), *arguments, common, true);
      fmt::print("{}", *drawing ? graph::dot(*graph) : graph::explain(*graph));
      return done;
    };
  });
}

}  // namespace tofgraph::cli
