// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/run.hpp"
#include "cli/command_line.hpp"
#include "cli/time_limit.hpp"
#include "cli/untrusted.hpp"
#include "cli/view.hpp"
#include "cli/watch.hpp"
#include "cli/written_files.hpp"
#include "config/json_text.hpp"

#include "config/quantity.hpp"
#include "graph/outputs.hpp"
#include "graph/validation.hpp"
#include "io/output_file.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdio>
#include <limits>

namespace tofgraph::cli {
namespace {

/// Name of a node that may write this file, or empty.
std::string writer_of(const std::filesystem::path& path, const graph::Graph& graph) {
  std::error_code error;
  const std::filesystem::path whole = std::filesystem::weakly_canonical(std::filesystem::absolute(path), error);
  const io::OutputPattern file = io::OutputPattern::of_file(whole);
  for (const auto& node : graph.nodes()) {
    for (const io::OutputPattern& output : graph::output_files(*node))
      if (output.overlaps(file)) return node->name;
  }
  return {};
}

/// Reason why the statistics cannot be written, or empty. @param graph whose files they must not replace
std::string statistics_problem(const RunArguments& arguments, graph::Graph& graph) {
  const std::filesystem::path path = arguments.stats;
  if (path.empty()) return {};
  std::vector<std::filesystem::path> inputs(1, arguments.pipeline);
  inputs.insert(inputs.end(), graph.host().inputs.begin(), graph.host().inputs.end());
  std::string problem = io::write_error(path);
  if (problem.empty()) problem = io::input_problem(path, inputs);
  const std::string writer = writer_of(path, graph);
  if (problem.empty() && !writer.empty()) problem = fmt::format("node '{}' writes this file", writer);
  std::error_code error;
  if (problem.empty() && !arguments.force && std::filesystem::exists(path, error))
    problem = "the file exists\n         --force replaces it";
  return problem.empty() ? problem : fmt::format("--stats {}: error: {}", arguments.stats, problem);
}

/// @returns the run's exit code; failed if only the statistics failed. The run's own messages come first.
int write_statistics(const RunArguments& arguments, graph::Graph& graph, const graph::RunResult& result, int code) {
  if (arguments.stats.empty()) return code;
  try {
    // The file may have been created during the run.
    if (const std::string problem = statistics_problem(arguments, graph); !problem.empty())
      throw std::runtime_error(problem);
    io::write_file(arguments.stats, config::json_text(graph::statistics_json(graph, result), 2) + "\n");
    return code;
  } catch (const std::exception& error) {
    print_message(fmt::format("error: the statistics of the run could not be written: {}", error.what()));
    return code == done ? failed : code;
  }
}

/// Reports the files that nodes wrote, and older ones left between them.
void report_outputs(const graph::Graph& graph, const graph::RunResult& result, const WrittenFiles& files) {
  for (const auto& node : graph.nodes()) {
    if (result.nodes[node->index].frames == 0) continue;  // an upstream filter may have dropped all frames
    for (const io::OutputPattern& pattern : node->outputs()) {
      if (pattern.text().empty()) continue;
      print_message(fmt::format("  {} wrote {}", node->name, std::filesystem::proximate(pattern.text()).string()));
    }
    for (const io::OutputPattern& pattern : graph::output_files(*node)) {
      if (const std::string older = files.older(pattern); !older.empty())
        print_message(fmt::format("  {}: {}", node->name, older));
    }
  }
}

/// Prints the result of a run to standard error. @returns the exit code
int report(const graph::Graph& graph, const graph::RunResult& result, const WrittenFiles& files, const Common& common) {
  if (!common.quiet) {
    print_message(
        fmt::format("{} in {}, {:.1f} frames/s{}", config::counted(result.frames, "frame"),
                    config::format_quantity(result.wall_s, "s"),
                    result.wall_s > 0 ? static_cast<double>(result.frames) / result.wall_s : 0.0,
                    result.dropped != 0 ? fmt::format(", {} dropped", config::counted(result.dropped, "frame")) : ""));
  }
  if (common.verbose) {
    for (const graph::NodeStatistics& node : result.nodes) {
      print_message(fmt::format("  {:20} {:>15}, median {}, 99 % {}, longest {}", node.name,
                                config::counted(node.frames, "frame"), config::format_quantity(node.median_s, "s"),
                                config::format_quantity(node.p99_s, "s"), config::format_quantity(node.max_s, "s")));
    }
  }
  const std::string written = common.quiet ? "" : files.summary(graph);
  for (const std::string& warning : result.warnings)
    if (!common.quiet) print_message("warning: " + warning);
  if (!result.error.empty()) {
    if (!written.empty()) print_message(written);
    print_message("error: " + result.error);
    return failed;
  }
  if (!common.quiet && result.frames != 0) report_outputs(graph, result, files);
  if (!written.empty()) print_message(written);
  if (result.interrupted) {
    print_message("interrupted: the frames up to here are complete");
    return interrupted;
  }
  const bool loss_allowed = graph.queue().policy == graph::QueuePolicy::drop_oldest;
  return result.dropped != 0 && !loss_allowed ? failed : done;
}

/// Time after which the run is ended, s; infinity: never. @throws config::ConfigurationError
double time_limit_of(const RunArguments& arguments, const UntrustedLimits& limits) {
  if (arguments.time_limit.empty()) return arguments.untrusted ? limits.time : std::numeric_limits<double>::infinity();
  return parse_time_limit(arguments.time_limit);
}

/// Folder of the pipeline file; the working folder for a one-line pipeline.
std::filesystem::path folder_of(const RunArguments& arguments) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(arguments.pipeline, error)) return std::filesystem::current_path();
  return std::filesystem::absolute(arguments.pipeline).parent_path();
}

}  // namespace

int run_once(const config::Value& document, const RunArguments& arguments, const Common& common) {
  if (arguments.validate) graph::set_validating();
  const UntrustedLimits limits;
  const double seconds = time_limit_of(arguments, limits);
  std::optional<TimeLimit> time;
  if (std::isfinite(seconds)) time.emplace(seconds);
  const auto graph = build(document, arguments, common, arguments.force);
  if (const std::string problem = statistics_problem(arguments, *graph); !problem.empty())
    throw config::ConfigurationError(problem);
  for (const auto& node : graph->nodes()) {
    if (arguments.validate) node->set_validating();
  }
  if (arguments.untrusted) refuse_outputs_outside(*graph, folder_of(arguments));
  const WrittenFiles files(*graph);
  graph::RunOptions options;
  if (arguments.frames != 0) options.frames = arguments.frames;
  options.threads = arguments.threads;
  graph::Node& source = *graph->nodes().front();
  if (arguments.untrusted && arguments.frames == 0) source.set_max_frames(limits.frames);
  graph::Runner runner(*graph, options);
  handle_signals();
  graph::RunResult result;
  {
    const Watch watch(runner, common.quiet);
    result = runner.run();
  }
  if (time && time->reached() && result.interrupted && result.error.empty())
    result.error = fmt::format("stopped after {}, the limit of {}; the frames up to here are complete",
                               config::format_quantity(seconds, "s"),
                               arguments.time_limit.empty() ? "--untrusted" : "--time-limit");
  if (source.exceeded_max_frames() && result.error.empty())
    result.error = fmt::format(
        "stopped after {} frames, the limit of --untrusted; the frames up to here are complete\n"
        "         --frames N sets another limit",
        limits.frames);
  return write_statistics(arguments, *graph, result, report(*graph, result, files, common));
}

namespace {

/// Runs the pipeline once, or once for each condition of a campaign.
int run_as_asked(const RunArguments& arguments, const Common& common) {
  if (arguments.safe) graph::use_built_in_plugins_only();
  if (arguments.view && !arguments.campaign.empty())
    throw config::ConfigurationError("--view: error: is for one run, not for a campaign");
  if (arguments.untrusted && !arguments.campaign.empty())
    throw config::ConfigurationError("--untrusted: error: is for one run, not for a campaign");
  if (!arguments.campaign.empty()) return run_campaign(arguments, common);
  if (!arguments.out.empty())
    throw config::ConfigurationError("--out: error: is for --campaign: write the path at the sinks of the pipeline");
  config::Value document = arguments.document();
  if (arguments.untrusted) {
    if (arguments.view)
      throw config::ConfigurationError("--view: error: opens a network port, which --untrusted does not allow");
    refuse_reach(document);
    restrict_process({});
  }
  if (arguments.view) document = with_view(std::move(document), {}, common);
  return run_once(document, arguments, common);
}

}  // namespace

void add_run(CLI::App& app, Common& common) {
  auto arguments = std::make_shared<RunArguments>();
  CLI::App* command = app.add_subcommand("run", "Run a pipeline");
  command->footer(
      "Examples: tofgraph run pipelines/quickstart.yaml --force\n"
      "          tofgraph run \"capture_reader file=a.h5 ! four_phase_decoder ! optimized_bistatic ! point_cloud ! "
      "pcd_writer path=a.pcd\" --camera camcube2\n"
      "          tofgraph run corrected.yaml --campaign campaign/campaign.yaml -o corrected");
  arguments->add_to(*command);
  command->add_option("--frames", arguments->frames, "Stop after this number of frames")
      ->option_text("N")
      ->check(whole_number(1, 1000000000));
  command->add_option("--threads", arguments->threads, "Threads that process frames; default: one per core")
      ->option_text("N")
      ->check(whole_number(1, 1024));
  command->add_option("--stats", arguments->stats, "Write times, drops and memory as JSON to this file")
      ->option_text("FILE");
  command->add_flag("--validate", arguments->validate,
                    "Check how each stage treats the frames: memory, channels that it only reads, NaN and flags");
  command->add_flag("--safe", arguments->safe, "Run without plugins that did not come with the program");
  command
      ->add_option("--time-limit", arguments->time_limit,
                   "End the run after this time, e.g. '5 min', with exit code 1; the frames up to then are complete")
      ->option_text("TIME");
  command->add_flag(
      "--untrusted", arguments->untrusted,
      "For a pipeline from an untrusted source: outputs in its own folder only, no other plugins, devices or "
      "ports, at most 4 GB of memory, 10000 frames (--frames) and 10 minutes (--time-limit)");
  command->add_flag("--force", arguments->force, "Replace existing outputs");
  command->add_flag("--view", arguments->view,
                    "Show every node in the web browser, at http://localhost:8765; other settings: --set "
                    "live_view.port=9000 ('tofgraph describe live_view')");
  command
      ->add_option("--campaign", arguments->campaign,
                   "Run the pipeline on the captures of every condition of this campaign, with --out FOLDER")
      ->option_text("FILE");
  command
      ->add_option("-o,--out", arguments->out,
                   "With --campaign: the folder of the results, one folder per condition and campaign.yaml")
      ->option_text("FOLDER");
  command->callback(
      [arguments, &common] { common.command = [arguments, &common] { return run_as_asked(*arguments, common); }; });
}

}  // namespace tofgraph::cli
