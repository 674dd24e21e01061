// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/record.hpp"
#include "cli/watch.hpp"
#include "config/diagnostics.hpp"
#include "config/quantity.hpp"
#include "io/captures/capture.hpp"
#include "io/captures/repair.hpp"
#include "recording/pipelines.hpp"

#include <fmt/format.h>

#include <optional>

namespace tofgraph::cli {
namespace {

namespace fs = std::filesystem;

/// A quantity of an option, which must be positive. @throws config::ConfigurationError
double positive(const char* option, const std::string& text, const char* unit, const char* example) {
  const config::Quantity quantity = config::parse_quantity(text, unit);
  if (quantity.ok() && quantity.value > 0) return quantity.value;
  throw config::ConfigurationError(fmt::format("{}: error: '{}' {}\n         example: {} '{}'", option, text,
                                               quantity.ok() ? "must be greater than 0" : quantity.problem, option,
                                               example));
}

graph::GraphOptions graph_options(const RecordArguments& arguments) {
  graph::GraphOptions options;
  options.plugin_folders = arguments.plugin_folders;
  options.overwrite = arguments.force;
  if (!arguments.quiet)
    options.message = [](const std::string& node, const std::string& text, bool warning) {
      say(fmt::format("{}: {}{}", node, warning ? "warning: " : "", text));
    };
  return options;
}

/// What the capture itself says of the frames in it, or what is left of it.
struct Written {
  fs::path file;
  std::size_t frames = 0, missing = 0;
  double seconds = 0;  ///< from the first to the last frame, where they have time stamps
};

std::optional<Written> written_to(const fs::path& capture) {
  std::error_code error;
  Written written{capture};
  if (!fs::exists(capture, error)) written.file += ".part";
  if (!fs::exists(written.file, error)) return std::nullopt;
  try {
    const io::CaptureReader reader(written.file);
    written.frames = reader.frames();
    for (std::size_t i = 1; i < written.frames; ++i)
      written.missing += io::frames_between(reader.metadata(i - 1).device_number, reader.metadata(i).device_number);
    if ((reader.known(0, written.frames - 1) & TOFGRAPH_KNOWS_TIMESTAMP) != 0)
      written.seconds =
          static_cast<double>(reader.metadata(written.frames - 1).timestamp_ns - reader.metadata(0).timestamp_ns) *
          1e-9;
  } catch (const std::exception&) {  // no frame was complete
    return std::nullopt;
  }
  return written;
}

/// In words on standard error. @returns the frames that arrived and are not in the capture
std::uint64_t report(const graph::RunResult& result, const std::optional<Written>& written, bool quiet) {
  const std::uint64_t arrived = result.nodes.front().frames, kept = written ? written->frames : 0;
  const std::uint64_t lost = arrived > kept ? arrived - kept : 0;
  if (quiet) return lost;
  if (written) {
    const double rate = written->seconds > 0 ? static_cast<double>(kept - 1) / written->seconds : 0;
    say(fmt::format(
        "{}: {}{}", written->file.string(), config::counted(kept, "frame"),
        rate > 0 ? fmt::format(" in {}, {:.1f} frames/s", config::format_quantity(written->seconds, "s"), rate) : ""));
    if (written->missing != 0)
      say(fmt::format("  {} missing between them, by the camera's counter ('tofgraph info' shows where)",
                      config::counted(written->missing, "frame")));
  }
  if (result.dropped != 0)
    say(fmt::format("  {} dropped, as the disk was too slow", config::counted(result.dropped, "frame")));
  if (lost > result.dropped)
    say(fmt::format("  {} from the camera {} not in it", config::counted(lost - result.dropped, "frame"),
                    lost - result.dropped == 1 ? "is" : "are"));
  return lost;
}

int record_capture(const RecordArguments& arguments) {
  const double most = arguments.duration.empty() ? std::numeric_limits<double>::infinity()
                                                 : positive("--for", arguments.duration, "s", "30 s");
  const auto graph =
      recording::recording_graph(arguments.camera, arguments.out, arguments.comment, graph_options(arguments));
  graph::RunOptions options;
  if (arguments.frames != 0) options.frames = arguments.frames;
  graph::Runner runner(*graph, options);
  handle_signals();
  graph::RunResult result;
  {
    const Watch watch(runner, arguments.quiet, most);
    result = runner.run();
  }
  const auto written = written_to(arguments.out);
  const std::uint64_t lost = report(result, written, arguments.quiet);
  if (!result.error.empty()) {
    say("error: " + result.error);
    if (written && written->file != arguments.out)
      say(fmt::format("         tofgraph repair {} makes a capture of it", written->file.string()));
    return 1;
  }
  if (lost != 0) {
    say(fmt::format("error: {} that came from the camera {} not in the recording", config::counted(lost, "frame"),
                    lost == 1 ? "is" : "are"));
    return 1;
  }
  if (signals != 0) {
    say("interrupted: the frames up to here are complete");
    return 130;
  }
  return written ? 0 : 1;
}

}  // namespace

int record(const RecordArguments& arguments) { return record_capture(arguments); }

}  // namespace tofgraph::cli

extern "C" __attribute__((visibility("default"))) int tofgraph_command(const void* arguments) {
  return tofgraph::cli::record(*static_cast<const tofgraph::cli::RecordArguments*>(arguments));
}
