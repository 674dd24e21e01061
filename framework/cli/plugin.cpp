// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/plugin.hpp"
#include "cli/command_line.hpp"

#include <CLI/CLI.hpp>

namespace tofgraph::cli {
namespace {

void add_new(CLI::App& command, Common& common) {
  auto plugin = std::make_shared<NewPlugin>();
  CLI::App* sub = command.add_subcommand("new", "Make a folder with a plugin that builds, its test and a README");
  sub->footer("Example: tofgraph plugin new edge_mask --kind filter");
  sub->add_option("NAME", plugin->name, "The name of the stage or effect: small letters, digits and _")->required();
  sub->add_option("--kind", plugin->kind, "source, filter (default), sink or effect")
      ->option_text("KIND")
      ->check(one_of({"source", "filter", "sink", "effect"}));
  sub->add_option("--language", plugin->language, "c++ (default), c or python")
      ->option_text("LANGUAGE")
      ->check(one_of({"c++", "c", "python"}));
  sub->add_option("-o,--out", plugin->folder, "The folder to make; default: NAME")->option_text("FOLDER");
  sub->callback([plugin, &common] { common.command = [plugin, &common] { return new_plugin(*plugin, common); }; });
}

void add_check_plugin(CLI::App& command, Common& common) {
  auto plugin = std::make_shared<CheckedPlugin>();
  CLI::App* sub = command.add_subcommand("check", "Check a plugin: each check in a process of its own");
  sub->footer(
      "Example: tofgraph plugin check build/tofgraph_filter_edge_mask.so --strictness 10\n"
      "         tofgraph plugin check --list");
  sub->add_option("FILE", plugin->file, "The library, tofgraph_KIND_NAME.so");
  sub->add_option("--strictness", plugin->strictness, "1 to 10 (all checks); default 5")
      ->option_text("N")
      ->check(whole_number(1, 10));
  sub->add_option("--only", plugin->only, "Run one check, whatever its strictness")->option_text("CHECK");
  sub->add_option("--set", plugin->settings, "A value for a required parameter; may be repeated")
      ->option_text("PARAMETER=VALUE")
      ->take_all()
      ->expected(1);
  sub->add_option("--seed", plugin->seed, "Seed of the random values; default 1")
      ->option_text("N")
      ->check(whole_number(0));
  sub->add_flag("--json", plugin->as_json, "As JSON");
  sub->add_flag("--list", plugin->list, "List the checks with their descriptions, and run none");
  sub->callback([plugin, &common] { common.command = [plugin] { return check_plugin(*plugin); }; });
}

}  // namespace

void add_plugin(CLI::App& app, Common& common) {
  CLI::App* command = app.add_subcommand("plugin", "Make plugins of your own, and check them");
  command->require_subcommand(1);
  command->footer(
      "Examples: tofgraph plugin new edge_mask --kind filter\n"
      "          tofgraph plugin check edge_mask/build/tofgraph_filter_edge_mask.so");
  add_new(*command, common);
  add_check_plugin(*command, common);
}

}  // namespace tofgraph::cli
