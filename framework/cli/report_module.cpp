// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/characterisation.hpp"
#include "cli/notes.hpp"
#include "cli/progress.hpp"
#include "cli/report.hpp"
#include "config/diagnostics.hpp"
#include "config/json_text.hpp"
#include "io/output_file.hpp"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <array>
#include <thread>

namespace tofgraph::cli {
namespace {

namespace fs = std::filesystem;

int report(const ReportArguments& arguments) {
  const fs::path out(arguments.out);
  for (const char* name : {"report.html", "report.json"}) {
    const std::array<fs::path, 2> inputs = {arguments.campaign, arguments.model};
    std::string problem = io::input_problem(out / name, inputs);
    if (problem.empty()) problem = io::output_problem(out / name, arguments.force, "--force");
    if (!problem.empty()) throw config::ConfigurationError(fmt::format("--out: error: {}", problem));
  }
  const graph::PluginRegistry registry(arguments.plugin_folders);
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    arguments.threads != 0 ? arguments.threads : std::thread::hardware_concurrency());
  Progress bar(arguments.quiet);
  calibration::CharacterisationRequest request{.campaign = {.campaign = arguments.campaign}, .model = arguments.model};
  request.campaign.progress = [&](double share, const std::string& what) { bar.show(share, what); };
  const calibration::Characterisation data = calibration::characterise(request, registry);
  bar.show(1, "drawing");
  const report::Page page = calibration::characterisation_report(data);
  bar.finish();
  page.write(out / "report.html");
  io::write_file(out / "report.json", config::json_text(calibration::characterisation_json(data), 2) + "\n");
  if (arguments.quiet) return 0;
  say_notes(data.campaign.boards.notes);
  config::print_message(fmt::format("{}\nwrote {} and {}", calibration::summary_of(data),
                                    (out / "report.html").string(), (out / "report.json").string()));
  return 0;
}

}  // namespace
}  // namespace tofgraph::cli

extern "C" __attribute__((visibility("default"))) int tofgraph_command(const void* arguments) {
  return tofgraph::cli::report(*static_cast<const tofgraph::cli::ReportArguments*>(arguments));
}
