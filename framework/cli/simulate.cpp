// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/simulate.hpp"

#include "cli/command_line.hpp"
#include "cli/commands.hpp"

#include <CLI/CLI.hpp>

namespace tofgraph::cli {

void add_simulate(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<SimulateArguments>();
  CLI::App* command = app.add_subcommand("simulate", "Simulate the recordings that a camera would make of a scene");
  command->add_option("SCENE", arguments->scene, "A scene file")->required();
  command
      ->add_option("-o,--out", arguments->out,
                   "The capture (.h5); for a scene with a sequence, a folder with a campaign and its captures")
      ->option_text("OUT");
  command->add_option("--model", arguments->model, "A model file: light and effects, instead of the scene's")
      ->option_text("FILE");
  command
      ->add_option("--preview", arguments->preview,
                   "A picture (.png) of the first condition: phases, amplitude, distance, cloud")
      ->option_text("FILE");
  command->add_option("--seed", arguments->seed, "Seed of the noise, instead of the scene's")
      ->option_text("N")
      ->check(whole_number(0));
  command->add_option("--frames", arguments->frames, "Frames of each condition, instead of the scene's")
      ->option_text("N")
      ->check(whole_number(1));
  add_shard(*command, arguments->shard);
  command->add_option("--compression", arguments->compression, "Compression of the captures: 0 (none, default) to 9")
      ->option_text("N")
      ->check(whole_number(0, 9));
  command->add_option("--threads", arguments->threads, "Threads; default: one per core")
      ->option_text("N")
      ->check(whole_number(1, 1024));
  command->add_flag("--truth", arguments->truth, "Add the true depth, points and reflectivity");
  command->add_flag("--force", arguments->force, "Replace existing outputs");
  command->footer("Example: tofgraph simulate pipelines/scenes/boxes.yaml -o boxes.h5 --preview boxes.png");
  command->callback([arguments, &common] {
    if (arguments->out.empty() && arguments->preview.empty()) throw CLI::RequiredError("-o OUT or --preview OUT.png");
    common.command = [arguments, &common] {
      arguments->quiet = common.quiet;
      arguments->plugin_folders = common.plugin_folders;
      return run_module("simulate", arguments.get());
    };
  });
}

}  // namespace tofgraph::cli
