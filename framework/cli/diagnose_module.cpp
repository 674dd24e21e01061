// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/diagnose.hpp"
#include "cli/progress.hpp"
#include "config/diagnostics.hpp"
#include "diagnosis/diagnosis.hpp"
#include "diagnosis/gap_report.hpp"
#include "io/output_file.hpp"

#include <fmt/format.h>
#include <malloc.h>
#include <tbb/global_control.h>

#include <array>
#include <thread>

namespace tofgraph::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* output_names[] = {"report.html", "report.json", "model.yaml", diagnosis::map_file_name,
                                        diagnosis::unexplained_map_name};

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
  options.skip_missing = arguments.skip_missing;
  options.search.max_effects = arguments.max_effects;
  options.confidence = arguments.confidence;
  options.search.seed = arguments.seed;
  options.progress = [&](double share, const std::string& what) { bar.show(share, what); };
  std::unique_ptr<diagnosis::Diagnosis> result;
  try {
    result = diagnosis::diagnose(registry, options);
  } catch (const std::invalid_argument& error) {
    throw config::ConfigurationError(fmt::format("{}: error: {}", arguments.data, error.what()));
  }
  bar.finish();
  const fs::path out(arguments.out);
  diagnosis::write_maps(*result, out);
  io::write_file(out / "model.yaml", diagnosis::model_yaml(*result));
  io::write_file(out / "report.json", diagnosis::report_json(*result).dump(2) + "\n");
  if (const std::string map = diagnosis::unexplained_map(*result); map.empty())
    fs::remove(out / diagnosis::unexplained_map_name);  // of a search before, which is to be replaced
  else
    io::write_file(out / diagnosis::unexplained_map_name, map);
  diagnosis::gap_report(*result).write(out / "report.html");
  if (!arguments.quiet) say(fmt::format("{}\nwrote {}", diagnosis::summary(*result), written(out)));
  return 0;
}

}  // namespace
}  // namespace tofgraph::cli

extern "C" __attribute__((visibility("default"))) int tofgraph_command(const void* arguments) {
  return tofgraph::cli::diagnose(*static_cast<const tofgraph::cli::DiagnoseArguments*>(arguments));
}
