// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/condition_statistics.hpp"

#include "config/quantity.hpp"

#include <fmt/format.h>
#include <tofgraph/physics/exposures.hpp>

#include <cmath>
#include <sstream>
#include <stdexcept>

namespace tofgraph::io {
namespace {

/// First line in which two texts differ, as "now X, then Y".
std::string difference_of(const std::string& now, const std::string& then) {
  std::istringstream a(now), b(then);
  for (std::string x, y; std::getline(a, x) && std::getline(b, y);)
    if (x != y) return fmt::format("now '{}', then '{}'", x, y);
  return "another number of settings";
}

}  // namespace

std::array<std::uint64_t, 2> used_frames(const Condition& condition, std::uint64_t frames) {
  if (frames == 0) throw std::runtime_error("has no frames");
  const std::array<std::uint64_t, 2> used = condition.frames.value_or(std::array<std::uint64_t, 2>{0, frames - 1});
  if (used[1] >= frames)
    throw std::runtime_error(fmt::format("has {} frames, the campaign needs frame {}", frames, used[1]));
  return used;
}

void check_one_integration_time(const CaptureReader& capture, const std::array<std::uint64_t, 2>& frames) {
  const double first = capture.metadata(frames[0]).integration_time;
  for (std::uint64_t frame = frames[0]; frame <= frames[1] && frame < capture.frames(); ++frame) {
    const double time = capture.metadata(frame).integration_time;
    if (time != first && !(std::isnan(time) && std::isnan(first)))
      throw std::runtime_error(fmt::format(
          "was recorded with several integration times, {} and {}: give each a condition with its frames, e.g. "
          "frames: [0, 19]",
          config::format_quantity(first, "s"), config::format_quantity(time, "s")));
  }
}

void complete(Condition& condition, const CaptureFacts& capture, const tofgraph_camera& camera) {
  const tofgraph_metadata& first = capture.first;
  const double frequency = first.modulation_frequency;
  if (std::isfinite(frequency) && std::abs(frequency / camera.modulation_frequency - 1) > 1e-3)
    throw std::runtime_error(fmt::format("was recorded at {}, the camera '{}' works at {}",
                                         config::format_quantity(frequency, "Hz"), camera.name,
                                         config::format_quantity(camera.modulation_frequency, "Hz")));
  if (std::isnan(condition.integration_time)) condition.integration_time = first.integration_time;
  if (std::isnan(condition.time_since_power_on)) condition.time_since_power_on = first.time_since_power_on;
  if (std::isnan(condition.temperature)) condition.temperature = first.temperature;
  if (std::isnan(condition.integration_time))
    throw std::runtime_error("does not state its integration time; write e.g. integration_time: 1 ms in the campaign");
}

std::string statistics_settings(const std::string& capture_sha256, const std::array<std::uint64_t, 2>& frames,
                                const Camera& camera) {
  const tofgraph_camera& view = camera.view();
  std::string text =
      fmt::format("version {}\ncapture {}\nframes {} to {}\ncamera {}\nwidth {}\nheight {}\n", statistics_version,
                  capture_sha256, frames[0], frames[1], view.name, view.width, view.height);
  text += fmt::format("full_well {}\nmodulation_frequency {}\n", view.full_well, view.modulation_frequency);
  for (const tofgraph_exposure& e : physics::exposures_of(view))
    text += fmt::format("exposure {} {}\n", e.phase, e.frequency);
  return text;
}

Statistics read_statistics(const Condition& condition, const Camera& camera) {
  Statistics statistics = read_statistics(condition.capture);
  const StatisticsHeader& h = statistics.header;
  const std::string now = statistics_settings(h.capture_sha256, used_frames(condition, h.facts.frames), camera);
  if (now != h.settings)
    throw std::runtime_error(
        fmt::format("was made with other settings: {}; reduce the campaign again", difference_of(now, h.settings)));
  return statistics;
}

}  // namespace tofgraph::io
