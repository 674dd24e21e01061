// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/record.hpp"
#include "cli/watch.hpp"
#include "config/diagnostics.hpp"
#include "config/lost_frames.hpp"
#include "config/quantity.hpp"
#include "io/captures/capture.hpp"
#include "io/captures/repair.hpp"
#include "io/output_file.hpp"
#include "io/profile.hpp"
#include "recording/guide.hpp"

#include <fmt/format.h>

#include <poll.h>
#include <unistd.h>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <optional>
#include <system_error>

namespace tofgraph::cli {
namespace {

namespace fs = std::filesystem;

/// Parses an option's quantity, which must be positive. @throws config::ConfigurationError
double positive(const char* option, const std::string& text, const char* unit, const char* example) {
  const config::Quantity quantity = config::parse_quantity(text, unit);
  if (quantity.ok() && quantity.value > 0) return quantity.value;
  throw config::ConfigurationError(fmt::format("{}: error: '{}' {}\n         example: {} '{}'", option, text,
                                               quantity.ok() ? "must be greater than 0" : quantity.problem, option,
                                               example));
}

[[noreturn]] void refuse(const std::string& option, const std::string& why) {
  throw config::ConfigurationError(fmt::format("{}: error: {}", option, why));
}

/// Rejects options that have no effect or conflict with others.
void check_options(const RecordArguments& arguments) {
  if (arguments.align) {
    if (!arguments.plan.empty()) refuse("--align", "records nothing; with a plan, answer 'look'");
    if (!arguments.out.empty()) refuse("--align", "records nothing: remove -o");
    for (const auto& [option, given] :
         {std::pair{"--frames", arguments.frames != 0}, std::pair{"--duration", !arguments.duration.empty()},
          std::pair{"--comment", !arguments.comment.empty()}, std::pair{"--force", arguments.force}})
      if (given) refuse(option, "--align records nothing and ends with Ctrl-C: remove it");
  } else if (arguments.out.empty()) {
    refuse("--out", "is missing: the capture to write\n         example: -o board.h5");
  }
  if (arguments.plan.empty()) {
    if (!arguments.alignment.empty())
      refuse("--alignment", "is for --plan, which states which boards are perpendicular; remove it, or use --align");
    if (arguments.still) refuse("--auto-trigger", "is for --plan, which states the distances of the boards; remove it");
    if (!arguments.tolerance.empty())
      refuse("--tolerance", "is for --plan, which states the distances of the boards; remove it");
    return;
  }
  if (!arguments.duration.empty()) refuse("--duration", "a plan is recorded by frames\n         example: --frames 20");
  if (!arguments.comment.empty()) refuse("--comment", "a plan writes the condition into each capture; remove it");
  if (arguments.force)
    refuse("--force",
           "a plan continues with the conditions that are not recorded, and replaces nothing: move away the captures "
           "that are to be recorded again");
  for (const std::string& setting : arguments.camera.settings) {
    std::string key = setting.substr(0, setting.find('='));
    for (const char* node : {recording::camera_node_name, recording::capture_node_name})
      if (const std::string before = std::string(node) + "."; key == before + "integration_time" ||
                                                              key == before + "auto_integration_time" ||
                                                              key == before + "comment" || key == before + "path")
        key = key.substr(before.size());
    if (key == "integration_time" || key == "auto_integration_time")
      refuse("--set " + setting, "the plan states the integration times; remove it");
    if (key == "comment" || key == "path") refuse("--set " + setting, "the plan states it; remove it");
  }
}

/// Creates and removes a folder: the only reliable test for write access. @throws config::ConfigurationError
void check_folder_of(const fs::path& out) {
  fs::path folder = fs::absolute(out).parent_path();
  std::error_code error;
  while (!fs::exists(folder, error) && folder.has_relative_path()) folder = folder.parent_path();
  std::string trial = (folder / ".tofgraph-XXXXXX").string();
  if (mkdtemp(trial.data()) == nullptr)
    refuse("--out", fmt::format("{} cannot be written: nothing can be made in the folder {}: {}", out.string(),
                                folder.string(), std::generic_category().message(errno)));
  rmdir(trial.c_str());
}

/// @param lost_frames counts the frames dropped because the camera's own queue was full
graph::GraphOptions graph_options(const RecordArguments& arguments, std::atomic<std::uint64_t>& lost_frames) {
  graph::GraphOptions options;
  options.plugin_folders = arguments.plugin_folders;
  options.overwrite = arguments.force;
  options.message = [&lost_frames, quiet = arguments.quiet](const std::string& node, const std::string& text,
                                                            bool warning) {
    if (warning && node == recording::camera_node_name) lost_frames += config::lost_frames_in(text);
    if (!quiet) print_message(fmt::format("{}: {}{}", node, warning ? "warning: " : "", text));
  };
  return options;
}

/// Frames in the capture according to its header, or the recovered part.
struct Written {
  fs::path file;
  std::size_t frames = 0, missing = 0;
  double seconds = 0;  ///< from the first to the last frame, if they have time stamps
};

/// @param result of the run that wrote the capture; frames from earlier runs are not counted
std::optional<Written> written_to(const fs::path& capture, const graph::RunResult& result) {
  std::error_code error;
  Written written{io::CaptureWriter::part_of(capture)};
  if (!fs::exists(written.file, error)) written.file = capture;
  const auto node = std::ranges::find(result.nodes, recording::capture_node_name, &graph::NodeStatistics::name);
  const bool wrote = node != result.nodes.end() && node->frames != 0;
  if (!wrote || !fs::exists(written.file, error)) return std::nullopt;
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

/// Prints a summary to standard error. @param lost_frames number of frames dropped by the camera's queue
/// @returns the number of frames that arrived but are not in the capture
std::uint64_t report(const graph::RunResult& result, const std::optional<Written>& written, std::uint64_t lost_frames,
                     bool quiet) {
  const std::uint64_t arrived = result.nodes.front().frames, kept = written ? written->frames : 0;
  const std::uint64_t lost = arrived > kept ? arrived - kept : 0;
  if (quiet) return lost + lost_frames;
  if (written) {
    const double rate = written->seconds > 0 ? static_cast<double>(kept - 1) / written->seconds : 0;
    print_message(fmt::format(
        "{}: {}{}", written->file.string(), config::counted(kept, "frame"),
        rate > 0 ? fmt::format(" in {}, {:.1f} frames/s", config::format_quantity(written->seconds, "s"), rate) : ""));
    if (written->missing != 0)
      print_message(fmt::format("  {} missing between them, by the camera's counter ('tofgraph info' shows where)",
                                config::counted(written->missing, "frame")));
  }
  if (result.dropped != 0)
    print_message(fmt::format("  {} dropped, as the disk was too slow", config::counted(result.dropped, "frame")));
  if (lost > result.dropped)
    print_message(fmt::format("  {} from the camera {} not in it", config::counted(lost - result.dropped, "frame"),
                              lost - result.dropped == 1 ? "is" : "are"));
  return lost + lost_frames;
}

int record_capture(const RecordArguments& arguments) {
  const double most = arguments.duration.empty() ? std::numeric_limits<double>::infinity()
                                                 : positive("--duration", arguments.duration, "s", "30 s");
  check_folder_of(arguments.out);
  std::atomic<std::uint64_t> lost_frames{0};
  const auto graph = recording::recording_graph(arguments.camera, arguments.out, arguments.comment, {},
                                                graph_options(arguments, lost_frames));
  graph::RunOptions options;
  if (arguments.frames != 0) options.frames = arguments.frames;
  graph::Runner runner(*graph, options);
  handle_signals();
  graph::RunResult result;
  {
    const Watch watch(runner, arguments.quiet, most);
    result = runner.run();
  }
  const auto written = written_to(arguments.out, result);
  const bool unknown = !written && !result.error.empty();  // the error message states the number of frames written
  const std::uint64_t lost = unknown ? 0 : report(result, written, lost_frames, arguments.quiet);
  if (!result.error.empty()) {
    print_message("error: " + result.error);
    if (written && written->file.extension() == ".part")
      print_message(fmt::format("         tofgraph repair {} makes a capture of it", written->file.string()));
    return 1;
  }
  if (lost != 0) {
    print_message(fmt::format("error: {} that came from the camera {} not in the recording",
                              config::counted(lost, "frame"), lost == 1 ? "is" : "are"));
    return 1;
  }
  if (signals != 0) {
    print_message("interrupted: the frames up to here are complete");
    return 130;
  }
  return written ? 0 : 1;
}

/// Reads lines from standard input; an interrupt ends the wait.
class Answers {
 public:
  std::optional<std::string> line() {
    for (;;) {
      if (const auto end = text_.find('\n'); end != std::string::npos) {
        std::string line = text_.substr(0, end);
        text_.erase(0, end + 1);
        return line;
      }
      pollfd input{STDIN_FILENO, POLLIN, 0};
      const int ready = poll(&input, 1, 100);
      if (signals != 0) throw recording::Interrupted();
      if (ready <= 0) continue;
      char part[256];
      const ssize_t size = read(STDIN_FILENO, part, sizeof part);
      if (size == 0 || (size < 0 && errno != EINTR)) return std::nullopt;
      if (size > 0) text_.append(part, static_cast<std::size_t>(size));
    }
  }

 private:
  std::string text_;
};

/// Ends a run cleanly when the user interrupts it.
graph::RunResult run_or_interrupt(graph::Runner& runner) {
  const Watch watch(runner, true);
  graph::RunResult result = runner.run();
  if (signals != 0) throw recording::Interrupted();
  return result;
}

void wait_a_moment() {
  for (int i = 0; i < 10 && signals == 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  if (signals != 0) throw recording::Interrupted();
}

/// Displays the camera's view until an interrupt: in one line on a terminal, else one line per update.
int align(const RecordArguments& arguments) {
  std::atomic<std::uint64_t> lost_frames{0};
  graph::GraphOptions quiet = graph_options(arguments, lost_frames);
  quiet.message = nullptr;
  handle_signals();
  const bool terminal = isatty(STDERR_FILENO) != 0;
  try {
    for (;;) {
      const std::string seen = recording::look(arguments.camera, quiet, run_or_interrupt).text();
      if (terminal)
        fmt::print(stderr, "\r\033[K{}", seen);
      else
        print_message(seen);
      wait_a_moment();
    }
  } catch (const recording::Interrupted&) {
    if (terminal) fmt::print(stderr, "\n");
  }
  return 130;
}

recording::GuideOptions guide_options(const RecordArguments& arguments, const recording::Plan& plan, Answers& answers,
                                      std::atomic<std::uint64_t>& lost_frames) {
  recording::GuideOptions options;
  options.camera = arguments.camera;
  if (options.camera.profile.empty() && options.camera.spec.starts_with("camcube"))
    options.camera.profile = io::camera_name_in(*plan.campaign.camera_value, fs::current_path());
  options.graph = graph_options(arguments, lost_frames);
  options.frames = arguments.frames;
  options.still = arguments.still;
  if (!arguments.tolerance.empty()) options.tolerance = positive("--tolerance", arguments.tolerance, "m", "250 mm");
  if (!arguments.alignment.empty()) options.alignment = positive("--alignment", arguments.alignment, "m", "3 mm");
  options.run = run_or_interrupt;
  options.read_line = [&answers] { return answers.line(); };
  options.print_message = [](const std::string& text) { print_message(text); };
  options.wait = wait_a_moment;
  return options;
}

/// Opens the camera briefly, before the user sets anything up. @throws config::ConfigurationError
recording::CameraIdentity check_camera(const recording::GuideOptions& options, const recording::Plan& plan) {
  graph::GraphOptions quiet = options.graph;
  quiet.message = nullptr;
  const auto graph = recording::looking_graph(options.camera, quiet);
  recording::CameraIdentity camera = recording::identity_of(*graph);
  const tofgraph_camera& planned = plan.campaign.camera->view();
  if (camera.name != planned.name)
    refuse("--camera", fmt::format("this is the camera '{}', the plan {} is for '{}'", camera.name, plan.file.string(),
                                   planned.name));
  return camera;
}

int record_plan(const RecordArguments& arguments) {
  const recording::Plan plan = recording::read_plan(arguments.plan);
  if (const std::string problem = io::write_error(arguments.out / "campaign.yaml"); !problem.empty())
    throw config::ConfigurationError("--out: error: " + problem);
  check_folder_of(arguments.out / "campaign.yaml");
  Answers answers;
  std::atomic<std::uint64_t> lost_frames{0};  // a capture with lost frames is recorded again
  const recording::GuideOptions options = guide_options(arguments, plan, answers, lost_frames);
  recording::CampaignFolder folder(plan, arguments.out, check_camera(options, plan), frames_of(plan, options));
  handle_signals();
  recording::Outcome outcome = recording::Outcome::stopped;
  try {
    outcome = recording::Guide(plan, folder, options).run();
  } catch (const recording::Interrupted&) {
  }
  const std::size_t all = plan.campaign.conditions.size();
  print_message(fmt::format("{} of {} recorded: {}", folder.recorded_count(), config::counted(all, "condition"),
                            folder.campaign_file().string()));
  if (outcome == recording::Outcome::complete) return 0;
  if (outcome == recording::Outcome::no_answer) print_message("standard input has ended: no more answers can be read");
  print_message("the same command continues with those that are not recorded");
  return outcome == recording::Outcome::stopped ? 130 : 1;
}

}  // namespace

int record(const RecordArguments& arguments) {
  check_options(arguments);
  if (arguments.align) return align(arguments);
  return arguments.plan.empty() ? record_capture(arguments) : record_plan(arguments);
}

}  // namespace tofgraph::cli

extern "C" __attribute__((visibility("default"))) int tofgraph_command(const void* arguments) {
  return tofgraph::cli::record(*static_cast<const tofgraph::cli::RecordArguments*>(arguments));
}
