// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/report.hpp"

#include "cli/command_line.hpp"
#include "cli/commands.hpp"

#include <CLI/CLI.hpp>

namespace tofgraph::cli {

void add_report(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<ReportArguments>();
  CLI::App* command = app.add_subcommand(
      "report", "Characterise a camera: errors over distance, integration time and image, and their causes");
  command->add_option("CAMPAIGN", arguments->campaign, "The campaign file: boards at known distances")->required();
  command->add_option("-o,--out", arguments->out, "A folder for report.html and report.json")
      ->option_text("FOLDER")
      ->required();
  command
      ->add_option(
          "--model", arguments->model,
          "A model of the camera: the report states the error of these boards that each of its effects causes, in mm")
      ->option_text("FILE");
  command->add_option("--threads", arguments->threads, "Threads; default: one per core")
      ->option_text("N")
      ->check(whole_number(1, 1024));
  command->add_flag("--force", arguments->force, "Replace existing outputs");
  command->footer("Example: tofgraph report campaign/campaign.yaml -o characterisation");
  command->callback([arguments, &common] {
    common.command = [arguments, &common] {
      arguments->quiet = common.quiet;
      arguments->plugin_folders = common.plugin_folders;
      return run_module("report", arguments.get());
    };
  });
}

}  // namespace tofgraph::cli
