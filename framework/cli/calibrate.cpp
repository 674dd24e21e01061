// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/calibrate.hpp"

#include "cli/commands.hpp"

#include <CLI/CLI.hpp>

namespace tofgraph::cli {
namespace {

/// Options that only some kinds of calibration have.
void add_options_of_kinds(CLI::App& command, CalibrateArguments& arguments) {
  command
      .add_option("--variant", arguments.variant,
                  "offset: geometric (default), or printed, as the tables of the reference were computed")
      ->option_text("WORD")
      ->check(CLI::IsMember({"geometric", "printed"}));
  command.add_option("--range", arguments.range, "integration-time: distances that matter, e.g. 0.5m..4m")
      ->option_text("FROM..TO");
  command
      .add_option("--accuracy", arguments.accuracy,
                  "integration-time: accuracy that is wanted there; warm-up: drift that is tolerated; e.g. 5mm")
      ->option_text("LENGTH");
  command
      .add_option("--roi", arguments.roi,
                  "warm-up: window of the reported means, columns and rows, e.g. 96..107,96..107; default: that of the "
                  "conditions, else the four centre pixels")
      ->option_text("C..C,R..R");
  command
      .add_option("--corrected-at", arguments.corrected_at,
                  "warm-up: time since power-on whose offset corrects the whole series in the reported RMSE; default: "
                  "1 h, or the end of a shorter series")
      ->option_text("TIME");
  command
      .add_option("--free", arguments.free,
                  "intrinsics: fitted beyond fx fy cx cy k1 k2 p1 p2: k3, skew, rational (k4 k5 k6); e.g. k3,skew")
      ->option_text("WORDS")
      ->delimiter(',')
      ->check(CLI::IsMember({"k3", "skew", "rational"}));
  command
      .add_option("--without", arguments.without,
                  "intrinsics: distances: the board's measured distances are not used; warp: the board is flat")
      ->option_text("WORDS")
      ->delimiter(',')
      ->check(CLI::IsMember({"distances", "warp"}));
}

}  // namespace

void add_calibrate(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<CalibrateArguments>();
  CLI::App* command = app.add_subcommand("calibrate", "Make a calibration file from a campaign, with a report");
  command
      ->add_option("WHAT", arguments->what,
                   "What to calibrate: intrinsics, offset, integration-time, noise, warm-up, fixed-pattern, "
                   "response")
      ->required();
  command->add_option("CAMPAIGN", arguments->campaign, "The campaign file: what was recorded, and of what")->required();
  command
      ->add_option("-o,--out", arguments->out,
                   "The calibration file; beside it its report (.html) and, of some kinds, a model of what was found "
                   "(.model.yaml) and maps of the pixels (.maps.h5)")
      ->option_text("FILE")
      ->required();
  add_options_of_kinds(*command, *arguments);
  command->add_option("--threads", arguments->threads, "Threads; default: one per core")
      ->option_text("N")
      ->check(CLI::Range(1, 1024));
  command->add_flag("--force", arguments->force,
                    "Replace existing outputs; write a calibration that does not improve held-out conditions");
  command->footer("Example: tofgraph calibrate offset campaign/campaign.yaml -o camera_offset.yaml");
  command->callback([arguments, &common] {
    common.command = [arguments, &common] {
      arguments->quiet = common.quiet;
      return run_module("calibrate", arguments.get());
    };
  });
}

}  // namespace tofgraph::cli
