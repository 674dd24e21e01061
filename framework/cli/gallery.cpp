// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/gallery.hpp"

#include "cli/command_line.hpp"
#include "cli/commands.hpp"

#include <CLI/CLI.hpp>

namespace tofgraph::cli {

void add_gallery(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<GalleryArguments>();
  CLI::App* command = app.add_subcommand("gallery", "Make a page that shows the result of every effect");
  command->footer("Example: tofgraph gallery -o effects.html");
  command->add_option("-o,--out", arguments->out, "The page (.html)")->option_text("FILE")->required();
  command->add_option("--camera", arguments->camera, "A profile by name or path; default: camcube2")
      ->option_text("CAMERA");
  command->add_option("--light", arguments->light, "reference (default) or physical")
      ->option_text("LIGHT")
      ->check(one_of({"reference", "physical"}));
  command->add_flag("--force", arguments->force, "Replace the page if it exists");
  command->callback([arguments, &common] {
    common.command = [arguments, &common] {
      arguments->quiet = common.quiet;
      arguments->plugin_folders = common.plugin_folders;
      return run_module("gallery", arguments.get());
    };
  });
}

}  // namespace tofgraph::cli
