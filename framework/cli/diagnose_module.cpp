// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/diagnose.hpp"
#include "cli/progress.hpp"
#include "cli/shell_words.hpp"
#include "cli/time_limit.hpp"
#include "config/diagnostics.hpp"
#include "config/json_text.hpp"
#include "config/quantity.hpp"
#include "diagnosis/diagnose.hpp"
#include "diagnosis/report/diagnosis.hpp"
#include "io/output_files.hpp"
#include "reduction/statistics_folder.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <malloc.h>
#include <tbb/global_control.h>

#include <array>
#include <chrono>

namespace tofgraph::cli {
namespace {

namespace fs = std::filesystem;

static_assert(DiagnoseArguments::usual_max_conditions == diagnosis::settings.max_conditions);

constexpr const char* output_names[] = {"report.html",
                                        "report.json",
                                        "model.yaml",
                                        diagnosis::map_file_name,
                                        diagnosis::unexplained_map_name,
                                        diagnosis::next_condition_name};

void check_outputs(const DiagnoseArguments& arguments) {
  for (const char* name : output_names) {
    const std::array<fs::path, 2> inputs = {arguments.model, arguments.data};
    std::string problem = io::input_problem(fs::path(arguments.out) / name, inputs);
    if (problem.empty()) problem = io::output_problem(fs::path(arguments.out) / name, arguments.force, "--force");
    if (!problem.empty()) throw config::ConfigurationError(fmt::format("--out: error: {}", problem));
  }
}

/// Existing output files; stale ones of an earlier search were removed by write_outputs().
std::string written(const fs::path& out) {
  std::string text;
  for (const char* name : output_names) {
    if (fs::exists(out / name)) text += (text.empty() ? "" : ", ") + (out / name).string();
  }
  return text;
}

/// Command line that reproduces the result.
std::string command_of(const DiagnoseArguments& a) {
  std::string text =
      fmt::format("tofgraph diagnose --model {} --data {} -o {}", in_shell(a.model), in_shell(a.data), in_shell(a.out));
  const DiagnoseArguments usual;
  if (a.max_effects != usual.max_effects) text += fmt::format(" --max-effects {}", a.max_effects);
  if (!a.time_limit.empty()) text += " --time-limit " + in_shell(a.time_limit);
  if (a.seed != usual.seed) text += fmt::format(" --seed {}", a.seed);
  for (const std::string& name : a.without) text += " --exclude-effect " + in_shell(name);
  if (a.confidence != usual.confidence) text += fmt::format(" --confidence {}", a.confidence);
  if (a.resample != usual.resample) text += fmt::format(" --stability-selection {}", a.resample);
  for (const std::string& id : a.skip) text += " --exclude-condition " + in_shell(id);
  if (a.max_conditions != usual.max_conditions) text += fmt::format(" --max-conditions {}", a.max_conditions);
  if (a.skip_missing) text += " --skip-missing";
  if (a.other_serial) text += " --other-serial";
  for (const fs::path& folder : a.plugin_path) text += " --plugin-path " + in_shell(folder.string());
  return text;
}

/// Replaces the results of an earlier search in the folder, all or none of them.
void write_outputs(const diagnosis::Diagnosis& result, const fs::path& out) {
  io::OutputFiles files;
  const auto write_or_drop = [&](const char* name, const std::string& text) {
    if (text.empty())
      files.drop(out / name);
    else
      files.add(out / name).write(text);
  };
  diagnosis::write_maps(result, out, files);
  files.add(out / "model.yaml").write(diagnosis::model_yaml(result));
  files.add(out / "report.json").write(config::json_text(diagnosis::report_json(result), 2) + "\n");
  write_or_drop(diagnosis::unexplained_map_name, diagnosis::unexplained_map(result));
  write_or_drop(diagnosis::next_condition_name, diagnosis::next_condition_yaml(result));
  files.add(out / "report.html").write(diagnosis::gap_report(result).html());
  files.commit();
}

/// Shard of the cases, after checking that its results can be written.
config::Shard checked_shard(const DiagnoseArguments& arguments, const fs::path& cases) {
  const config::Shard shard = config::parse_shard(arguments.shard);
  if (!arguments.time_limit.empty() && (!shard.is_whole() || config::ranks().size() > 1))
    throw config::ConfigurationError(
        "--time-limit: error: the cases of shards and ranks need the whole search, which a limit may cut short\n"
        "         remove --time-limit, or run one process without --shard");
  if (shard.is_whole()) {
    check_outputs(arguments);
    return shard;
  }
  if (arguments.confidence == 0)
    throw config::ConfigurationError(
        "--shard: error: it divides the cases of --confidence, which is not given\n"
        "         example: --confidence 32 --shard 1/4");
  if (const std::string problem = io::write_error(cases / "case"); !problem.empty())
    throw config::ConfigurationError(fmt::format("--out: error: {}", problem));
  return shard;
}

void print_cases(const DiagnoseArguments& arguments, const diagnosis::Diagnosis& result, const fs::path& cases) {
  if (arguments.quiet) return;
  print_message(fmt::format("{}: {} of {} cases are done\n         the same command without --shard evaluates them",
                            cases.string(), result.confidence ? result.confidence->cases() : 0, arguments.confidence));
}

int diagnose(const DiagnoseArguments& arguments) {
  // A search repeatedly allocates the same arrays; returning them to the system costs a fifth of the time.
  mallopt(M_MMAP_THRESHOLD, 1 << 28);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  const fs::path cases = fs::path(arguments.out) / "cases";
  const config::Shard shard = checked_shard(arguments, cases);
  const graph::PluginRegistry registry(arguments.plugin_folders);
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    arguments.threads != 0 ? arguments.threads : config::default_threads());
  Progress bar(arguments.quiet);
  diagnosis::DiagnosisOptions options;
  options.model = arguments.model;
  options.data = reduction::campaign_in(arguments.data);
  options.exclude_effects = arguments.without;
  options.exclude_conditions = arguments.skip;
  options.max_conditions = arguments.max_conditions;
  options.skip_missing = arguments.skip_missing;
  options.other_serial = arguments.other_serial;
  options.search.max_effects = arguments.max_effects;
  options.time_limit = arguments.time_limit.empty() ? 0 : parse_time_limit(arguments.time_limit);
  options.confidence = arguments.confidence;
  options.shard = shard;
  options.cases = cases;
  options.random_halves = arguments.resample;
  options.search.seed = arguments.seed;
  options.warn = [&](const std::string& text) {
    if (!arguments.quiet) print_message(text);
  };
  options.progress = [&](double share, const std::string& what) { bar.show(share, what); };
  std::unique_ptr<diagnosis::Diagnosis> result;
  const auto begin = std::chrono::system_clock::now();
  try {
    result = diagnosis::diagnose(registry, options);
  } catch (const std::invalid_argument& error) {
    throw config::ConfigurationError(fmt::format("{}: error: {}", arguments.data, error.what()));
  }
  bar.finish();
  if (config::ranks().rank() != 0) return 0;  // the first rank writes
  if (!shard.is_whole()) {
    print_cases(arguments, *result, cases);
    return 0;
  }
  const auto end = std::chrono::system_clock::now();
  result->origin = {command_of(arguments), fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(begin)),
                    std::chrono::duration<double>(end - begin).count()};
  const fs::path out(arguments.out);
  write_outputs(*result, out);
  if (!arguments.quiet) print_message(fmt::format("{}\nwrote {}", diagnosis::summary(*result), written(out)));
  return 0;
}

}  // namespace
}  // namespace tofgraph::cli

extern "C" __attribute__((visibility("default"))) int tofgraph_command(const void* arguments) {
  return tofgraph::cli::diagnose(*static_cast<const tofgraph::cli::DiagnoseArguments*>(arguments));
}
