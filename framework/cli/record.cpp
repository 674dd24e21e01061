// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/record.hpp"

#include "cli/command_line.hpp"
#include "cli/commands.hpp"
#include "graph/camera_spec.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

namespace tofgraph::cli {
namespace {

void add_camera(CLI::App& command, RecordArguments& arguments) {
  command.add_option("--camera", arguments.camera.spec, fmt::format("The camera: {}", graph::camera_specs))
      ->option_text("SPEC")
      ->required();
  command
      .add_option("--profile", arguments.camera.profile,
                  "Camera profile by name or path; default: that of the recording or scene, else camcube2")
      ->option_text("CAMERA");
  command
      .add_option("--set", arguments.camera.settings,
                  "A parameter of the camera, integration_time='2 ms', or of the recording, capture.compression=1; may "
                  "be repeated ('tofgraph describe camcube', 'tofgraph describe capture_writer')")
      ->option_text("PARAMETER=VALUE")
      ->take_all()
      ->expected(1);
}

void add_plan(CLI::App& command, RecordArguments& arguments) {
  command
      .add_option("--plan", arguments.plan,
                  "Records the conditions of this campaign, or of this scene with a sequence, one after the other into "
                  "the folder -o; continues where it was stopped")
      ->option_text("CAMPAIGN.yaml");
  CLI::Option* const automatic = command.add_flag(
      "--auto-trigger", arguments.still,
      "With a plan: records as soon as the board stands still at its planned place, instead of on Enter");
  add_old_spelling(command, automatic, "--still", arguments.still);
  command
      .add_option("--alignment", arguments.alignment,
                  "With a plan: tolerated difference of the depths in the image's corners if a board without tilt "
                  "fills the image, e.g. 3mm; default: not checked")
      ->option_text("LENGTH");
  command
      .add_option("--tolerance", arguments.tolerance,
                  "With a plan: tolerated difference between the measured and the planned distance; default: 250 mm")
      ->option_text("LENGTH");
}

}  // namespace

void add_record(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<RecordArguments>();
  CLI::App* command = app.add_subcommand("record", "Record a live camera, or a whole campaign as it is planned");
  command->footer(
      "Examples: tofgraph record --camera camcube -o board.h5 --duration '30 s' --set integration_time='2 ms'\n"
      "          tofgraph record --camera simulated:pipelines/scenes/board.yaml -o board.h5 --frames 100\n"
      "          tofgraph record --plan campaign.yaml --camera camcube -o monday");
  add_camera(*command, *arguments);
  command->add_option("-o,--out", arguments->out, "The capture (.h5); with a plan, a folder")->option_text("OUT");
  command->add_flag("--align", arguments->align,
                    "Records nothing: shows the distance in the middle and in the corners until Ctrl-C; equal corners "
                    "mean that the board is perpendicular");
  command->add_option("--frames", arguments->frames, "Stop after this number of frames; with a plan, of each condition")
      ->option_text("N")
      ->check(whole_number(1, 1000000000));
  CLI::Option* const duration =
      command->add_option("--duration", arguments->duration, "Stop after this time, e.g. '30 s'; default: until Ctrl-C")
          ->option_text("TIME");
  add_old_spelling(*command, duration, "--for", arguments->duration);
  command->add_option("--comment", arguments->comment, "Kept in the capture")->option_text("TEXT");
  command->add_flag("--force", arguments->force, "Replace an existing capture");
  add_plan(*command, *arguments);
  command->callback([arguments, &common] {
    common.command = [arguments, &common] {
      arguments->quiet = common.quiet;
      arguments->plugin_folders = common.plugin_folders;
      return run_module("record", arguments.get());
    };
  });
}

}  // namespace tofgraph::cli
