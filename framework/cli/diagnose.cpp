// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/diagnose.hpp"

#include "cli/command_line.hpp"
#include "cli/commands.hpp"

#include <CLI/CLI.hpp>

namespace tofgraph::cli {

namespace {

/// Adds the options for resources and for replacing outputs.
void add_run_options(CLI::App& command, DiagnoseArguments& arguments) {
  add_shard(command, arguments.shard);
  command.add_option("--threads", arguments.threads, "Threads; default: one per core")
      ->option_text("N")
      ->check(whole_number(1, 1024));
  CLI::Option* const exclude =
      command
          .add_option("--exclude-condition", arguments.skip,
                      "Exclude the condition with this id; several separated by commas, or the option several times")
          ->option_text("ID")
          ->delimiter(',')
          ->expected(1)
          ->take_all();
  add_old_spelling(command, exclude, "--skip", arguments.skip)->delimiter(',')->expected(1)->take_all();
  command
      .add_option("--max-conditions", arguments.max_conditions,
                  "Conditions that are searched; of a larger campaign, representative ones are searched and the others "
                  "are only predicted; default: 500")
      ->option_text("N")
      ->check(whole_number(3));
  command.add_flag("--skip-missing", arguments.skip_missing, "Continue without the captures that cannot be read");
  command.add_flag("--other-serial", arguments.other_serial,
                   "Use a model of a device with another serial number, with a note");
  command.add_flag("--force", arguments.force, "Replace existing outputs");
}

}  // namespace

void add_diagnose(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<DiagnoseArguments>();
  CLI::App* command =
      app.add_subcommand("diagnose", "Find the effects that a simulation lacks, add them, show that the gap shrinks");
  command->add_option("--model", arguments->model, "The model file: the simulation to compare with")
      ->option_text("FILE")
      ->required();
  command
      ->add_option("--data", arguments->data,
                   "The campaign file: measured captures with the truth of their scenes; or a folder of `reduce`")
      ->option_text("DATA")
      ->required();
  command->add_option("-o,--out", arguments->out, "A folder for report.html, report.json and the extended model.yaml")
      ->option_text("FOLDER")
      ->required();
  command->add_option("--max-effects", arguments->max_effects, "Effects that may be added; default: 6")
      ->option_text("N")
      ->check(whole_number(0));
  command
      ->add_option("--seed", arguments->seed,
                   "Seed of the random choices: held-out levels, sign flips, bootstrap; default: 1")
      ->option_text("N")
      ->check(whole_number(0));
  CLI::Option* const exclude =
      command->add_option("--exclude-effect", arguments->without, "An effect that is not a candidate; may be repeated")
          ->option_text("EFFECT")
          ->expected(1)
          ->take_all();
  add_old_spelling(*command, exclude, "--without", arguments->without)->expected(1)->take_all();
  command
      ->add_option("--confidence", arguments->confidence,
                   "Inject this number of known truths into this design and report how often the search is right")
      ->option_text("N")
      ->check(whole_number(0));
  CLI::Option* const stability =
      command
          ->add_option("--stability-selection", arguments->resample,
                       "Choose effects again without each distance, without each target and without this number of "
                       "random halves of the levels, and report how often each is chosen; default: 40 if nothing was "
                       "measured twice, else none")
          ->option_text("N")
          ->check(whole_number(0));
  add_old_spelling(*command, stability, "--resample", arguments->resample)->check(whole_number(0));
  command
      ->add_option("--time-limit", arguments->time_limit,
                   "End within this time, e.g. '5 min': the best model that is verified by then is reported; default: "
                   "no limit")
      ->option_text("DURATION");
  add_run_options(*command, *arguments);
  command->footer("Example: tofgraph diagnose --model ideal.yaml --data campaign/campaign.yaml -o gap");
  command->callback([arguments, &common] {
    common.command = [arguments, &common] {
      arguments->quiet = common.quiet;
      arguments->plugin_folders = common.plugin_folders;
      arguments->plugin_path = common.plugin_path;
      return run_module("diagnose", arguments.get());
    };
  });
}

}  // namespace tofgraph::cli
