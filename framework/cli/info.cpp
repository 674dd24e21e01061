// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/info.hpp"

#include "cli/commands.hpp"

#include <CLI/CLI.hpp>

namespace tofgraph::cli {

void add_info(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<InfoArguments>();
  CLI::App* command = app.add_subcommand("info", "Show the contents of a recording: channels, frames, settings, gaps");
  command->footer("Example: tofgraph info capture.h5");
  command->add_option("CAPTURE", arguments->capture, "A capture (.h5), or one that is still being recorded (.h5.part)")
      ->required();
  command->add_flag("--json", arguments->json, "As JSON");
  command->callback(
      [arguments, &common] { common.command = [arguments] { return run_module("info", arguments.get()); }; });
}

}  // namespace tofgraph::cli
