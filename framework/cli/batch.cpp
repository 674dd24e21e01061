// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/batch.hpp"

#include "cli/command_line.hpp"
#include "cli/commands.hpp"

#include <CLI/CLI.hpp>

namespace tofgraph::cli {

void add_batch(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<BatchArguments>();
  CLI::App* command = app.add_subcommand(
      "batch", "Write the scripts that reduce and diagnose a large campaign with Slurm, GNU parallel or one by one");
  CLI::Option* const campaign = command->add_option("CAMPAIGN", arguments->campaign, "The campaign file");
  command->add_option("--model", arguments->model, "The model file for diagnose")->option_text("FILE");
  command
      ->add_option(
          "--engine", arguments->engine,
          "slurm: array jobs that wait for each other; parallel: GNU parallel; local: one task after the other")
      ->option_text("ENGINE")
      ->check(one_of({"slurm", "parallel", "local"}));
  command->add_option("-o,--out", arguments->out, "The folder of the job")->option_text("FOLDER");
  command->add_option("--shards", arguments->shards, "Tasks of reduce; default: so that each takes ten minutes")
      ->option_text("N")
      ->check(whole_number(1, 100000));
  command
      ->add_option("--confidence", arguments->confidence,
                   "As for diagnose; the cases are divided among the tasks like conditions")
      ->option_text("N")
      ->check(whole_number(0));
  command->add_option("--threads", arguments->threads, "Threads of a task; default: 1")
      ->option_text("N")
      ->check(whole_number(1, 1024));
  command->add_flag("--submit", arguments->submit,
                    "Submit the tasks that are not done; also for an existing job folder");
  command->add_flag("--force", arguments->force,
                    "Replace the scripts of the same job; outputs and environment.sh stay");
  std::string* const status = &arguments->out;
  auto asked = std::make_shared<std::string>();
  CLI::Option* const state = command->add_option("--status", *asked, "Print the progress of the job in this folder")
                                 ->option_text("FOLDER")
                                 ->excludes(campaign);
  command->footer("Example: tofgraph batch campaign.yaml --model ideal.yaml --engine slurm -o job --submit");
  command->callback([arguments, asked, status, state, &common] {
    arguments->status = state->count() > 0;
    if (arguments->status) *status = *asked;
    if (arguments->out.empty()) throw CLI::RequiredError("-o FOLDER");
    const bool again = arguments->campaign.empty() && arguments->submit;
    if (!arguments->status && !again && arguments->campaign.empty()) throw CLI::RequiredError("CAMPAIGN");
    if (!arguments->status && !again && arguments->model.empty()) throw CLI::RequiredError("--model FILE");
    common.command = [arguments, again, &common] {
      arguments->quiet = common.quiet;
      arguments->plugin_path = common.plugin_path;
      if (arguments->status) return run_job_script(*arguments, "status.sh");
      if (const int code = again ? 0 : make_job(*arguments); code != 0) return code;
      return arguments->submit ? run_job_script(*arguments, "submit.sh") : 0;
    };
  });
}

}  // namespace tofgraph::cli
