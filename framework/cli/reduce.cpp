// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/reduce.hpp"

#include "cli/command_line.hpp"
#include "cli/commands.hpp"

#include <CLI/CLI.hpp>

namespace tofgraph::cli {

void add_shard(CLI::App& command, std::string& shard) {
  command.add_option("--shard", shard, "Do part I of N only; the parts may run anywhere, in any order")
      ->option_text("I/N");
}

void add_reduce(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<ReduceArguments>();
  CLI::App* command =
      app.add_subcommand("reduce", "Reduce the captures of a campaign to small files of statistics for diagnose");
  command->add_option("CAMPAIGN", arguments->campaign, "The campaign file: captures with the truth of their scenes")
      ->required();
  command
      ->add_option("-o,--out", arguments->out,
                   "A folder for the statistics and their campaign.yaml; files in it that are complete are kept")
      ->option_text("FOLDER")
      ->required();
  add_shard(*command, arguments->shard);
  command->add_option("--threads", arguments->threads, "Threads; default: one per core")
      ->option_text("N")
      ->check(whole_number(1, 1024));
  command->footer("Example: tofgraph reduce campaign/campaign.yaml -o stats");
  command->callback([arguments, &common] {
    common.command = [arguments, &common] {
      arguments->quiet = common.quiet;
      return run_module("reduce", arguments.get());
    };
  });
}

void add_merge(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<ReduceArguments>();
  CLI::App* command = app.add_subcommand("merge", "Join the shards that reduce wrote, and check that none is missing");
  command->add_option("FOLDER", arguments->folders, "Folders of statistics, of one campaign")->required();
  command
      ->add_option("-o,--out", arguments->out,
                   "The folder for campaign.yaml and all statistics; default: the given folder if there is only one")
      ->option_text("FOLDER");
  command->footer("Example: tofgraph merge stats");
  command->callback([arguments, &common] {
    if (arguments->out.empty() && arguments->folders.size() != 1) throw CLI::RequiredError("-o FOLDER");
    if (arguments->out.empty()) arguments->out = arguments->folders.front();
    common.command = [arguments, &common] {
      arguments->quiet = common.quiet;
      return run_module("reduce", arguments.get());
    };
  });
}

}  // namespace tofgraph::cli
