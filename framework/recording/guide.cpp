// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "recording/guide.hpp"

#include "config/log.hpp"
#include "io/captures/capture.hpp"
#include "io/captures/repair.hpp"

#include <tofgraph/physics/constants.hpp>

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

namespace tofgraph::recording {
namespace fs = std::filesystem;
namespace {

constexpr int attempts = 3;            // for a recording with missing frames
constexpr double still_limit = 0.004;  // m, between two measurements of a resting board
constexpr double mostly = 0.5;         // fraction of saturated pixels

constexpr const char* answers =
    "Enter checks and records; 'look' only checks, 'record' records in any case, 'skip' postpones this condition, "
    "'quit' stops";

/// True if the camera is simulated from the plan's own scene, so that no target has to be set up by hand.
bool plays_the_plan(const CameraRequest& camera, const Plan& plan) {
  constexpr std::string_view kind = "simulated:";
  std::error_code error;
  return camera.spec.starts_with(kind) && fs::equivalent(camera.spec.substr(kind.size()), plan.file, error);
}

}  // namespace

Guide::Guide(const Plan& plan, CampaignFolder& folder, GuideOptions options)
    : plan_(plan), folder_(folder), options_(std::move(options)) {
  const double frequency = plan.campaign.camera->view().modulation_frequency;
  unambiguous_range_ = frequency > 0 ? physics::speed_of_light / (2 * frequency) : io::unknown;
}

CameraRequest Guide::camera_for(std::size_t index) const {
  CameraRequest camera = options_.camera;
  camera.integration_time = plan_.campaign.conditions[index].integration_time;
  if (plays_the_plan(camera, plan_)) camera.settings.push_back(fmt::format("condition={}", index));
  return camera;
}

Outcome Guide::run() {
  const std::size_t all = plan_.campaign.conditions.size();
  options_.print_message(fmt::format("{} of {} recorded so far; {} of each", folder_.recorded_count(),
                                     config::counted(all, "condition"), config::counted(frames(), "frame")));
  for (std::size_t i = 0; i < all; ++i) {
    if (folder_.recorded(i)) continue;
    options_.print_message(fmt::format("[{} of {}] {}", i + 1, all, condition_text(plan_.campaign.conditions[i])));
    const Answer answer = set_up(i);
    if (answer == Answer::stop || answer == Answer::none)
      return answer == Answer::stop ? Outcome::stopped : Outcome::no_answer;
    if (answer == Answer::record) record(i);
  }
  return folder_.recorded_count() == all ? Outcome::complete : Outcome::skipped;
}

/// Returns without a question if only the camera's settings change.
Guide::Answer Guide::set_up(std::size_t index) {
  const std::string wanted = setup_text(plan_.campaign.conditions[index]);
  if (standing_ == wanted || plays_the_plan(options_.camera, plan_)) {
    const Seen seen = look_at(index);
    options_.print_message("  " + seen.text());
    const std::string wrong = wrong_with(seen, index);
    if (wrong.empty()) return Answer::record;
    options_.print_message("  " + wrong);
  }
  standing_.reset();
  options_.print_message("  set up: " + wanted);
  const Answer answer = options_.still ? wait_until_still(index) : ask(index);
  if (answer == Answer::record) standing_ = wanted;
  return answer;
}

Guide::Answer Guide::ask(std::size_t index) {
  options_.print_message(fmt::format("  {}", answers));
  for (;;) {
    const auto line = options_.read_line();
    if (!line) return Answer::none;
    if (*line == "quit") return Answer::stop;
    if (*line == "skip") {
      before_.reset();  // the position of the board is then unknown
      return Answer::skip;
    }
    if (!line->empty() && *line != "look" && *line != "record") {
      options_.print_message(fmt::format("  '{}' is not an answer: {}", *line, answers));
      continue;
    }
    const Seen seen = look_at(index);
    options_.print_message("  " + seen.text());
    const std::string wrong = wrong_with(seen, index);
    if (!wrong.empty())
      options_.print_message(fmt::format("  {}: {}", *line == "record" ? "recorded anyway" : "not recorded", wrong));
    const bool go = *line == "record" || (line->empty() && wrong.empty());
    if (!go) continue;
    before_.reset();
    const double planned = plan_.campaign.conditions[index].board_distance;
    if (wrong.empty() && !std::isnan(planned)) before_ = Reference{planned, seen.distance};
    return Answer::record;
  }
}

/// Waits only if an unmoved board would be detected; otherwise the user must confirm that it is in place. A problem is
/// reported when it changes, not after every measurement.
Guide::Answer Guide::wait_until_still(std::size_t index) {
  const double planned = plan_.campaign.conditions[index].board_distance;
  if (!before_ || std::isnan(planned) || !change_shows(planned, before_->planned)) {
    options_.print_message("  a move this small cannot be detected: press Enter when the board is in place");
    return ask(index);
  }
  options_.print_message("  it is recorded as soon as the board stands still there");
  double last = io::unknown;
  std::string said;
  for (;;) {
    const Seen seen = look_at(index);
    std::string wrong = wrong_with(seen, index);
    if (wrong.empty() && std::abs(seen.distance - last) <= still_limit) {
      options_.print_message("  " + seen.text());
      before_ = Reference{planned, seen.distance};
      return Answer::record;
    }
    if (wrong != said && !wrong.empty()) options_.print_message("  " + wrong);
    said = std::move(wrong);
    last = seen.distance;
    options_.wait();
  }
}

/// Measures the board. If the planned integration time saturates the image, a shorter one is used.
Seen Guide::look_at(std::size_t index) const {
  graph::GraphOptions quiet = options_.graph;
  quiet.message = nullptr;
  CameraRequest camera = camera_for(index);
  Seen seen = look(camera, quiet, options_.run);
  const double shortest = std::max(plan_.campaign.camera->view().integration_time[0], 1e-6);
  while (std::isnan(seen.distance) && seen.saturated > mostly && camera.integration_time > shortest) {
    camera.integration_time = std::max(shortest, std::round(camera.integration_time / 4 * 1e6) * 1e-6);
    const Seen shorter = look(camera, quiet, options_.run);
    seen.distance = shorter.distance;
    if (shorter.saturated <= mostly) break;
  }
  return seen;
}

std::string Guide::wrong_with(const Seen& seen, std::size_t index) const {
  const io::Condition& condition = plan_.campaign.conditions[index];
  std::string wrong = contradiction(seen, condition.board_distance, before_, options_.tolerance, unambiguous_range_);
  const bool untilted = !(std::abs(condition.board_tilt_x) > 0) && !(std::abs(condition.board_tilt_y) > 0);
  if (wrong.empty() && options_.alignment && condition.has_board() && untilted && !condition.board_size)
    wrong = misaligned(seen, *options_.alignment);
  return wrong;
}

void Guide::record(std::size_t index) {
  for (int attempt = 1;; ++attempt) {
    const std::string problem = record_once(index);
    if (problem.empty()) break;
    if (attempt == attempts)
      throw std::runtime_error(fmt::format("{}: {}", plan_.campaign.conditions[index].id, problem));
    options_.print_message(fmt::format("  {}: recorded again", problem));
  }
  folder_.keep(index);
  options_.print_message(fmt::format("  recorded {}", config::counted(frames(), "frame")));
}

/// @returns the reason why the recording is incomplete, or nothing
std::string Guide::record_once(std::size_t index) const {
  const fs::path file = folder_.prepare_recording(index);
  graph::GraphOptions quiet = options_.graph;
  quiet.message = [this](const std::string& node, const std::string& text, bool warning) {
    if (warning) options_.print_message(fmt::format("  {}: warning: {}", node, text));
  };
  const auto graph = recording_graph(camera_for(index), file, condition_text(plan_.campaign.conditions[index]),
                                     plan_.campaign.conditions[index].sources, quiet);
  graph::RunOptions run_options;
  run_options.frames = frames();
  graph::Runner runner(*graph, run_options);
  const graph::RunResult result = options_.run(runner);
  if (!result.error.empty()) throw std::runtime_error(result.error);
  const io::CaptureReader reader(file);
  std::size_t missing = 0;
  for (std::size_t i = 1; i < reader.frames(); ++i)
    missing += io::frames_between(reader.metadata(i - 1).device_number, reader.metadata(i).device_number);
  if (reader.frames() == frames() && missing == 0) return {};
  const std::size_t lost = std::max<std::size_t>(missing, frames() - reader.frames());
  return fmt::format("{} missing", config::counted(lost, "frame"));
}

}  // namespace tofgraph::recording
