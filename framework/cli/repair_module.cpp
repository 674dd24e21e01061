// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/progress.hpp"
#include "cli/repair.hpp"
#include "config/diagnostics.hpp"
#include "io/captures/repair.hpp"
#include "io/output_file.hpp"

#include <fmt/format.h>

namespace tofgraph::cli {
namespace {

std::filesystem::path capture_of(const RepairArguments& arguments) {
  const auto refuse = [&](const std::string& problem) { throw config::ConfigurationError("error: " + problem); };
  std::filesystem::path file = arguments.out;
  if (file.empty()) {
    if (arguments.part.extension() != ".part")
      refuse(fmt::format("{} does not end with .part: name the capture, e.g. -o {}", arguments.part.string(),
                         std::filesystem::path(arguments.part).replace_extension(".repaired.h5").string()));
    file = arguments.part.parent_path() / arguments.part.stem();
  }
  std::string problem = io::output_problem(file, arguments.force, "--force");
  if (problem.empty()) problem = io::input_problem(file, std::span(&arguments.part, 1));
  if (!problem.empty()) refuse(problem);
  return file;
}

int repair(const RepairArguments& arguments) {
  const std::filesystem::path file = capture_of(arguments);
  Progress progress(arguments.quiet);
  const io::Repaired repaired =
      io::repair_capture(arguments.part, file, arguments.force, [&](std::size_t done, std::size_t all) {
        progress.show(static_cast<double>(done) / static_cast<double>(all),
                      fmt::format("{} of {}", done, config::counted(all, "frame")));
      });
  progress.finish();
  if (arguments.quiet) return 0;
  print_message(fmt::format(
      "wrote {}: {}{}", file.string(), config::counted(repaired.frames, "frame"),
      repaired.missing == 0 ? ", with none missing between them"
                            : fmt::format(", {} missing between them", config::counted(repaired.missing, "frame"))));
  if (repaired.cut)
    print_message(fmt::format("{} was cut off: {} of {} are lost{}", arguments.part.string(), repaired.lost,
                              config::counted(repaired.lost + repaired.frames, "frame"),
                              repaired.without_time == 0
                                  ? ""
                                  : fmt::format("; {} without time stamp: it is taken as unknown",
                                                config::counted(repaired.without_time, "frame"))));
  if (arguments.part.extension() == ".part" && repaired.lost == 0)
    print_message(arguments.part.string() + " is not needed any more");
  return 0;
}

}  // namespace
}  // namespace tofgraph::cli

extern "C" __attribute__((visibility("default"))) int tofgraph_command(const void* arguments) {
  return tofgraph::cli::repair(*static_cast<const tofgraph::cli::RepairArguments*>(arguments));
}
