// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/calibrate.hpp"
#include "cli/calibrate.hpp"
#include "cli/notes.hpp"
#include "cli/progress.hpp"
#include "config/diagnostics.hpp"
#include "config/log.hpp"
#include "config/quantity.hpp"
#include "io/output_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdio>
#include <thread>

namespace tofgraph::cli {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& option, const std::string& problem) {
  throw config::ConfigurationError(fmt::format("{}: error: {}", option, problem));
}

void check_outputs(const CalibrateArguments& arguments, const calibration::Kind& kind) {
  const fs::path out(arguments.out);
  if (out.extension() == ".html")
    refuse("--out", "is the calibration file, e.g. -o camera_offset.yaml; its report is .html");
  const std::array<fs::path, 1> inputs = {arguments.campaign};
  for (const fs::path& file : calibration::outputs_of(kind, out)) {
    std::string problem = io::input_problem(file, inputs);
    if (problem.empty()) problem = io::output_problem(file, arguments.force, "--force");
    if (!problem.empty()) refuse("--out", problem);
  }
}

/// Rejects options that belong to another kind of calibration.
void check_options(const CalibrateArguments& arguments, const calibration::Kind& kind) {
  const auto has = [](const calibration::Kind& k, const std::string& option) {
    const std::string words = fmt::format(" {} ", k.options);
    return words.find(fmt::format(" {} ", option)) != std::string::npos;
  };
  for (const auto& [option, given] : {std::pair{std::string("range"), !arguments.range.empty()},
                                      std::pair{std::string("accuracy"), !arguments.accuracy.empty()},
                                      std::pair{std::string("variant"), !arguments.variant.empty()},
                                      std::pair{std::string("roi"), !arguments.roi.empty()},
                                      std::pair{std::string("corrected-at"), !arguments.corrected_at.empty()},
                                      std::pair{std::string("free"), !arguments.free.empty()},
                                      std::pair{std::string("without"), !arguments.without.empty()}}) {
    if (!given || has(kind, option)) continue;
    std::vector<std::string> others;
    for (const calibration::Kind& other : calibration::kinds()) {
      if (has(other, option)) others.emplace_back(other.name);
    }
    refuse("--" + option,
           fmt::format("is for {}, the calibration is {}: leave it out", fmt::join(others, ", "), arguments.what));
  }
}

/// Parses a positive quantity with this SI unit.
double quantity_of(const std::string& option, const std::string& text, const char* unit, const char* example) {
  const config::Quantity quantity = config::parse_quantity(text, unit);
  if (!quantity.ok()) refuse(option, fmt::format("'{}': {}, e.g. {}", text, quantity.problem, example));
  if (!(quantity.value > 0)) refuse(option, fmt::format("'{}' must be positive, e.g. {}", text, example));
  return quantity.value;
}

std::array<double, 2> range_of(const std::string& text) {
  const std::size_t dots = text.find("..");
  if (dots == std::string::npos)
    refuse("--range", fmt::format("'{}' must be two distances, e.g. --range 0.5m..4m", text));
  const std::array<double, 2> range = {quantity_of("--range", text.substr(0, dots), "m", "0.5m..4m"),
                                       quantity_of("--range", text.substr(dots + 2), "m", "0.5m..4m")};
  if (!(range[0] <= range[1])) refuse("--range", fmt::format("'{}' must begin with the smaller distance", text));
  return range;
}

io::Roi roi_of(const std::string& text) {
  io::Roi roi;
  int end = 0;
  if (std::sscanf(text.c_str(), "%" SCNu32 "..%" SCNu32 ",%" SCNu32 "..%" SCNu32 "%n", &roi.first_column,
                  &roi.last_column, &roi.first_row, &roi.last_row, &end) != 4 ||
      static_cast<std::size_t>(end) != text.size() || roi.first_column > roi.last_column ||
      roi.first_row > roi.last_row)
    refuse("--roi", fmt::format("'{}' must be the first and last column and row, e.g. --roi 96..107,96..107", text));
  return roi;
}

int calibrate(const CalibrateArguments& arguments) {
  const calibration::Kind& kind = calibration::kind_of(arguments.what);
  check_options(arguments, kind);
  check_outputs(arguments, kind);
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    arguments.threads != 0 ? arguments.threads : std::thread::hardware_concurrency());
  Progress bar(arguments.quiet);
  calibration::Request request{.campaign = arguments.campaign, .output = arguments.out, .force = arguments.force};
  if (arguments.variant == "printed") request.variant = io::OffsetVariant::printed;
  if (!arguments.range.empty()) request.range = range_of(arguments.range);
  if (!arguments.accuracy.empty()) request.accuracy = quantity_of("--accuracy", arguments.accuracy, "m", "5mm");
  if (!arguments.roi.empty()) request.roi = roi_of(arguments.roi);
  if (!arguments.corrected_at.empty())
    request.corrected_at = quantity_of("--corrected-at", arguments.corrected_at, "s", "60min");
  request.free = arguments.free;
  request.without = arguments.without;
  request.progress = [&](double share, const std::string& what) { bar.show(share, what); };
  const calibration::Result result = calibration::calibrate(kind, request);
  bar.finish();
  calibration::write(result, kind, arguments.out);
  if (arguments.quiet) return 0;
  say_notes(result.notes);
  std::vector<std::string> written;
  for (const fs::path& file : calibration::outputs_of(kind, arguments.out)) written.push_back(file.string());
  std::ranges::reverse(written);
  config::print_message(fmt::format("{}\nwrote {}", result.summary, fmt::join(written, ", ")));
  return 0;
}

}  // namespace
}  // namespace tofgraph::cli

extern "C" __attribute__((visibility("default"))) int tofgraph_command(const void* arguments) {
  return tofgraph::cli::calibrate(*static_cast<const tofgraph::cli::CalibrateArguments*>(arguments));
}
