// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/command_line.hpp"
#include "cli/commands.hpp"
#include "cli/slow_calls.hpp"
#include "config/shard.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <memory>
#include <optional>

namespace tofgraph::cli {
namespace {

/// Returns the exit code of a command after flushing its output. A write error is a failure, reported unless the
/// command itself failed.
int with_output_written(int code) {
  errno = 0;
  const bool written = std::cout.flush().good() && std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  if (written || code != done) return code;
  print_message(fmt::format("tofgraph: error: standard output cannot be written{}{}", errno != 0 ? ": " : "",
                            errno != 0 ? std::strerror(errno) : ""));
  return failed;
}

}  // namespace

void PipelineArguments::add_to(CLI::App& command) {
  command
      .add_option("PIPELINE", pipeline,
                  "A pipeline file, or the one-line form in quotes: \"reader file=a.h5 ! decoder ! writer path=b.pcd\"")
      ->required();
  command.add_option("--camera", camera, "Camera profile by name or path; overrides the pipeline's")
      ->option_text("CAMERA");
  command.add_option("--set", settings, "Replaces a parameter of a node; may be repeated")
      ->option_text("NODE.PARAMETER=VALUE")
      ->take_all()
      ->expected(1);
  command.add_flag("--other-serial", other_serial,
                   "Use calibrations of a device with another serial number, with a warning");
}

void warn_shadowed(const graph::PluginRegistry& registry, const Common& common, const std::string& name) {
  for (const auto& [hidden, before] : registry.hidden()) {
    if (common.quiet || (!name.empty() && hidden.name != name)) continue;
    print_message(fmt::format("warning: {} hides {}: the first in the plugin path is used", before.path.string(),
                              hidden.path.string()));
  }
}

config::Value PipelineArguments::document() const { return graph::document_of(pipeline, camera); }

std::unique_ptr<graph::Graph> build(const config::Value& document, const PipelineArguments& arguments,
                                    const Common& common, bool overwrite) {
  graph::GraphOptions options;
  options.plugin_folders = common.plugin_folders;
  options.overwrite = overwrite;
  options.other_serial = arguments.other_serial;
  options.message = [&common](const std::string& node, const std::string& text, bool warning) {
    if (!common.quiet) print_message(fmt::format("{}: {}{}", node, warning ? "warning: " : "", text));
  };
  config::Diagnostics diagnostics;
  std::optional<SlowCalls> slow;
  if (!common.quiet) slow.emplace(5.0);
  auto graph = graph::build_graph(document, arguments.settings, options, diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  if (!common.quiet && !diagnostics.all().empty()) print_message(diagnostics.text());
  return graph;
}

}  // namespace tofgraph::cli

namespace {

/// Parses the command line and runs the command. @returns the exit code
int run_program(int argc, char** argv) {
  using namespace tofgraph;
  cli::Common common;
  CLI::App app("tofgraph turns what a time-of-flight camera measures into correct point clouds.", "tofgraph");
  app.formatter(cli::help_in_words());
  app.set_version_flag("--version", "tofgraph " TOFGRAPH_VERSION);
  app.set_help_flag("-h,--help", "Print this help and exit");
  app.require_subcommand(1);
  app.fallthrough();
  app.add_flag("--quiet", common.quiet, "Errors only");
  app.add_flag("-v,--verbose", common.verbose, "Say more");
  app.add_option("--plugin-path", common.plugin_folders,
                 "Folder with plugins, searched before TOFGRAPH_PLUGIN_PATH; may be repeated")
      ->option_text("FOLDER")
      ->take_all()
      ->expected(1);
  app.footer(
      "Exit codes: 0 done, 1 failed while running, 2 wrong usage or configuration, 130 interrupted.\n"
      "Example: tofgraph run pipelines/quickstart.yaml");
  for (auto* const add : {cli::add_run,      cli::add_check,   cli::add_explain,   cli::add_list,   cli::add_describe,
                          cli::add_simulate, cli::add_gallery, cli::add_info,      cli::add_record, cli::add_repair,
                          cli::add_pose,     cli::add_devices, cli::add_calibrate, cli::add_report, cli::add_diagnose,
                          cli::add_evaluate, cli::add_convert, cli::add_inspect,   cli::add_camera, cli::add_view,
                          cli::add_reduce,   cli::add_merge,   cli::add_batch,     cli::add_plugin, cli::add_manual})
    add(app, common);
  try {
    app.parse(argc, argv);
    common.plugin_path = common.plugin_folders;
    common.plugin_folders = graph::plugin_path(common.plugin_folders, [&common](const std::string& problem) {
      if (!common.quiet) cli::print_message("warning: " + problem);
    });
    common.quiet |= config::ranks().rank() != 0;  // rank 0 prints for all ranks
    if (config::ranks().size() > 1 && !app.got_subcommand("reduce") && !app.got_subcommand("diagnose"))
      throw config::ConfigurationError(
          "tofgraph: error: MPI divides the work of reduce and diagnose alone, every rank would do all of this command"
          "\n         start it without mpirun");
    return cli::with_output_written(common.command());
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return cli::with_output_written(app.exit(error));  // help or version
    const std::string unknown = cli::unknown_word(app);
    cli::print_message(unknown.empty() ? cli::usage_problem(app, error) : unknown);
    return cli::wrong_usage;
  } catch (const config::ConfigurationError& error) {
    cli::print_message(error.what());
    return cli::wrong_usage;
  } catch (const std::exception& error) {
    cli::print_message(fmt::format("tofgraph: error: {}", error.what()));
    return cli::failed;
  }
}

}  // namespace

int main(int argc, char** argv) {
  using namespace tofgraph;
  graph::install_crash_handler();
  try {
    if (!cli::join_ranks(argv[0])) return run_program(argc, argv);
  } catch (const std::exception& error) {
    cli::print_message(fmt::format("tofgraph: error: {}", error.what()));
    return cli::failed;
  }
  const int code = run_program(argc, argv);
  if (code != cli::done) config::ranks().abort(code);  // other ranks may be waiting for messages from this one
  config::set_ranks(std::make_unique<config::Ranks>());
  return code;
}
