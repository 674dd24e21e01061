// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/devices.hpp"

#include "cli/commands.hpp"

#include <CLI/CLI.hpp>

namespace tofgraph::cli {

void add_devices(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<DevicesArguments>();
  CLI::App* command =
      app.add_subcommand("devices", "List the cameras that are plugged in, and why they cannot be opened");
  command->footer("Example: tofgraph devices");
  command->add_flag("--json", arguments->json, "As JSON");
  command->callback(
      [arguments, &common] { common.command = [arguments] { return run_module("devices", arguments.get()); }; });
}

}  // namespace tofgraph::cli
