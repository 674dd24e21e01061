// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/evaluate.hpp"

#include "cli/command_line.hpp"
#include "cli/commands.hpp"

#include <CLI/CLI.hpp>

namespace tofgraph::cli {

void add_evaluate(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<EvaluateArguments>();
  CLI::App* command = app.add_subcommand(
      "evaluate", "Compare depths with the known planes of a campaign: bias, flatness, noise, by distance and radius");
  command
      ->add_option("CAMPAIGN", arguments->campaign,
                   "The campaign file: boards at known distances, as `run --campaign` writes it")
      ->required();
  command->add_option("-o,--out", arguments->out, "A folder for evaluation.html and evaluation.json")
      ->option_text("FOLDER")
      ->required();
  command
      ->add_option("--before", arguments->before,
                   "The campaign to compare with; default: the one that this campaign was made from")
      ->option_text("FILE");
  command->add_option("--threads", arguments->threads, "Threads; default: one per core")
      ->option_text("N")
      ->check(whole_number(1, 1024));
  command->add_flag("--force", arguments->force, "Replace existing outputs");
  command->footer("Example: tofgraph evaluate corrected/campaign.yaml -o accuracy");
  command->callback([arguments, &common] {
    common.command = [arguments, &common] {
      arguments->quiet = common.quiet;
      return run_module("evaluate", arguments.get());
    };
  });
}

}  // namespace tofgraph::cli
