// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/plane_evaluation.hpp"
#include "cli/evaluate.hpp"
#include "cli/notes.hpp"
#include "cli/progress.hpp"
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

constexpr const char* page_name = "evaluation.html";
constexpr const char* json_name = "evaluation.json";

int evaluate(const EvaluateArguments& arguments) {
  const fs::path out(arguments.out);
  for (const char* name : {page_name, json_name}) {
    const std::array<fs::path, 2> inputs = {arguments.campaign, arguments.before};
    std::string problem = io::input_problem(out / name, inputs);
    if (problem.empty()) problem = io::output_problem(out / name, arguments.force, "--force");
    if (!problem.empty()) throw config::ConfigurationError(fmt::format("--out: error: {}", problem));
  }
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    arguments.threads != 0 ? arguments.threads : std::thread::hardware_concurrency());
  Progress bar(arguments.quiet);
  const calibration::EvaluationResult result =
      calibration::evaluate_planes({.campaign = arguments.campaign,
                                    .before = arguments.before,
                                    .progress = [&](double share, const std::string& what) { bar.show(share, what); }});
  const report::Page page = calibration::evaluation_report(result);
  bar.finish();
  page.write(out / page_name);
  io::write_file(out / json_name, config::json_text(calibration::evaluation_json(result), 2) + "\n");
  fmt::print("{}", calibration::evaluation_table(result));
  if (arguments.quiet) return 0;
  say_notes(result.now.notes);
  config::print_message(fmt::format("wrote {} and {}", (out / page_name).string(), (out / json_name).string()));
  return 0;
}

}  // namespace
}  // namespace tofgraph::cli

extern "C" __attribute__((visibility("default"))) int tofgraph_command(const void* arguments) {
  return tofgraph::cli::evaluate(*static_cast<const tofgraph::cli::EvaluateArguments*>(arguments));
}
