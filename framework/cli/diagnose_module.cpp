// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/diagnose.hpp"
#include "cli/progress.hpp"
#include "config/diagnostics.hpp"
#include "diagnosis/diagnosis.hpp"
#include "diagnosis/gap_report.hpp"
#include "io/output_file.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <malloc.h>
#include <tbb/global_control.h>

#include <array>
#include <chrono>
#include <thread>

namespace tofgraph::cli {
namespace {

namespace fs = std::filesystem;

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

/// The outputs that are there: those of a search before that this one has not are removed.
std::string written(const fs::path& out) {
  std::string text;
  for (const char* name : output_names) {
    if (fs::exists(out / name)) text += (text.empty() ? "" : ", ") + (out / name).string();
  }
  return text;
}

/// The command line that gives the same result.
std::string command_of(const DiagnoseArguments& a) {
  std::string text = fmt::format("tofgraph diagnose --model {} --data {} -o {}", a.model, a.data, a.out);
  const DiagnoseArguments usual;
  if (a.max_effects != usual.max_effects) text += fmt::format(" --max-effects {}", a.max_effects);
  if (a.seed != usual.seed) text += fmt::format(" --seed {}", a.seed);
  for (const std::string& name : a.without) text += " --without " + name;
  if (a.confidence != usual.confidence) text += fmt::format(" --confidence {}", a.confidence);
  if (a.skip_missing) text += " --skip-missing";
  for (const fs::path& folder : a.plugin_folders) text += " --plugin-path " + folder.string();
  return text;
}

/// What a search of the same folder before had written and this one has not is removed.
void write_or_remove(const fs::path& file, const std::string& text) {
  if (text.empty())
    fs::remove(file);
  else
    io::write_file(file, text);
}

int diagnose(const DiagnoseArguments& arguments) {
  // A search makes and drops the same arrays over and over: giving them back to the system costs a fifth of the time.
  mallopt(M_MMAP_THRESHOLD, 1 << 28);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  check_outputs(arguments);
  const graph::PluginRegistry registry(arguments.plugin_folders);
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    arguments.threads != 0 ? arguments.threads : std::thread::hardware_concurrency());
  Progress bar(arguments.quiet);
  diagnosis::DiagnosisOptions options;
  options.model = arguments.model;
  options.data = arguments.data;
  options.without = arguments.without;
  options.skip = arguments.skip;
  options.skip_missing = arguments.skip_missing;
  options.search.max_effects = arguments.max_effects;
  options.confidence = arguments.confidence;
  options.search.seed = arguments.seed;
  options.progress = [&](double share, const std::string& what) { bar.show(share, what); };
  std::unique_ptr<diagnosis::Diagnosis> result;
  const auto begin = std::chrono::system_clock::now();
  try {
    result = diagnosis::diagnose(registry, options);
  } catch (const std::invalid_argument& error) {
    throw config::ConfigurationError(fmt::format("{}: error: {}", arguments.data, error.what()));
  }
  bar.finish();
  const auto end = std::chrono::system_clock::now();
  result->origin = {command_of(arguments), fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(begin)),
                    std::chrono::duration<double>(end - begin).count()};
  const fs::path out(arguments.out);
  diagnosis::write_maps(*result, out);
  io::write_file(out / "model.yaml", diagnosis::model_yaml(*result));
  io::write_file(out / "report.json", diagnosis::report_json(*result).dump(2) + "\n");
  write_or_remove(out / diagnosis::unexplained_map_name, diagnosis::unexplained_map(*result));
  write_or_remove(out / diagnosis::next_condition_name, diagnosis::next_condition_yaml(*result));
  diagnosis::gap_report(*result).write(out / "report.html");
  if (!arguments.quiet) say(fmt::format("{}\nwrote {}", diagnosis::summary(*result), written(out)));
  return 0;
}

}  // namespace
}  // namespace tofgraph::cli

extern "C" __attribute__((visibility("default"))) int tofgraph_command(const void* arguments) {
  return tofgraph::cli::diagnose(*static_cast<const tofgraph::cli::DiagnoseArguments*>(arguments));
}
