// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/pose.hpp"

#include "cli/commands.hpp"

#include <CLI/CLI.hpp>

namespace tofgraph::cli {

void add_pose(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<PoseArguments>();
  CLI::App* command = app.add_subcommand("pose", "Find the pose of the camera relative to a calibration pattern");
  command->footer(
      "Example: tofgraph pose board.h5 --pattern '{type: chessboard, columns: 8, rows: 6, square: 30 mm}' -o "
      "pose.yaml\n"
      "In a pipeline: {stage: transform, pose: pose.yaml} moves points into the frame of the pattern");
  command->add_option("CAPTURE", arguments->capture, "A capture that shows the pattern: amplitude or intensity")
      ->required();
  command
      ->add_option("--pattern", arguments->pattern,
                   "The pattern as in a campaign, e.g. '{type: chessboard, columns: 8, rows: 6, square: 30 mm}'")
      ->option_text("PATTERN")
      ->required();
  command
      ->add_option("--camera", arguments->camera,
                   "Profile with the lens, by name or path; default: that of the capture")
      ->option_text("CAMERA");
  command->add_option("-o,--out", arguments->out, "The calibration file of kind pose; default: it is only shown")
      ->option_text("FILE");
  command->add_flag("--force", arguments->force, "Replace an existing file");
  command->callback([arguments, &common] {
    common.command = [arguments, &common] {
      arguments->quiet = common.quiet;
      return run_module("pose", arguments.get());
    };
  });
}

}  // namespace tofgraph::cli
