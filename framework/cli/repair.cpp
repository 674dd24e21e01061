// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/repair.hpp"

#include "cli/commands.hpp"

#include <CLI/CLI.hpp>

namespace tofgraph::cli {

void add_repair(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<RepairArguments>();
  CLI::App* command =
      app.add_subcommand("repair", "Make a capture of the complete frames of a recording that was cut off");
  command->footer("Example: tofgraph repair board.h5.part    makes board.h5 of all complete frames; the .part stays");
  command->add_option("CAPTURE", arguments->part, "The recording that was cut off (.h5.part)")->required();
  command
      ->add_option("-o,--out", arguments->out,
                   "The capture to be made, e.g. on a disk with room; default: the name without .part")
      ->option_text("FILE");
  command->add_flag("--force", arguments->force, "Replace an existing capture");
  command->callback([arguments, &common] {
    common.command = [arguments, &common] {
      arguments->quiet = common.quiet;
      return run_module("repair", arguments.get());
    };
  });
}

}  // namespace tofgraph::cli
