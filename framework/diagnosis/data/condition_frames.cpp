// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/data/superpixels.hpp"

#include "io/captures/campaign_captures.hpp"
#include "io/captures/condition_statistics.hpp"
#include "io/captures/recording.hpp"
#include "io/sha256.hpp"

#include <fmt/format.h>

#include <array>
#include <stdexcept>

namespace tofgraph::diagnosis {
namespace {

FrameSums sums_of(const io::Recording& recording, const std::array<std::uint64_t, 2>& frames,
                  const tofgraph_camera& camera) {
  using Kind = io::Recording::Kind;
  static constexpr std::array kinds = {FrameSums::Kind::taps, FrameSums::Kind::phases, FrameSums::Kind::decoded,
                                       FrameSums::Kind::distances};
  const auto& header = recording.reader().header();
  FrameSums sums(kinds.at(static_cast<std::size_t>(recording.kind())), header.width, header.height,
                 Demodulation(physics::exposures_of(camera)));
  for (std::size_t f = frames[0]; f <= frames[1]; ++f) {
    if (recording.kind() == Kind::taps)
      sums.add_taps(recording.taps(f), camera.full_well);
    else if (recording.kind() == Kind::phases)
      sums.add_phases(recording.floats("phases", f));
    else
      sums.add_decoded(recording.floats("distance", f),
                       recording.kind() == Kind::decoded ? recording.floats("amplitude", f) : std::vector<float>{},
                       physics::metres_per_radian(camera.modulation_frequency));
  }
  return sums;
}

ConditionFrames of_statistics(const io::Condition& condition, const io::Camera& camera) {
  io::Statistics statistics = io::read_statistics(condition, camera);
  const io::CaptureFacts& facts = statistics.header.facts;
  return {facts, FrameSums(std::move(statistics.sums), facts.header.width, facts.header.height,
                           Demodulation(physics::exposures_of(camera.view())))};
}

/// @throws std::runtime_error if a capture does not fit the camera
void check_facts(const io::CaptureFacts& facts, const tofgraph_camera& camera) {
  if (facts.header.width != camera.width || facts.header.height != camera.height)
    throw std::runtime_error(fmt::format("is {} x {} px, the camera '{}' has {} x {}", facts.header.width,
                                         facts.header.height, camera.name, camera.width, camera.height));
  if (const std::string problem = io::other_exposures(facts, camera); !problem.empty())
    throw std::runtime_error(problem);
}

ConditionFrames of_capture(const io::Condition& condition, const io::Camera& camera) {
  const io::Recording recording(condition.capture);
  const io::CaptureFacts facts = io::facts_of(recording.reader(), condition);
  check_facts(facts, camera.view());
  if (recording.kind() == io::Recording::Kind::images)
    throw std::runtime_error("has neither taps nor phases nor distance");
  const std::array<std::uint64_t, 2> frames = io::used_frames(condition, facts.frames);
  io::check_one_integration_time(recording.reader(), frames);
  return {facts, sums_of(recording, frames, camera.view())};
}

}  // namespace

ConditionFrames read_frames(const io::Condition& condition, const io::Camera& camera) {
  ConditionFrames frames =
      io::is_statistics(condition.capture) ? of_statistics(condition, camera) : of_capture(condition, camera);
  check_facts(frames.facts, camera.view());
  for (std::size_t i = 0; i < frames.sums.width() * frames.sums.height() && !camera.bad_pixels.empty(); ++i)
    if (camera.is_bad(i)) frames.sums.leave_out(i);
  return frames;
}

io::Statistics reduce_capture(const io::Condition& condition, const io::Camera& camera, const std::string& shown,
                              const std::string& capture_sha256) {
  const ConditionFrames frames = of_capture(condition, camera);
  const std::array<std::uint64_t, 2> used = io::used_frames(condition, frames.facts.frames);
  io::Statistics result;
  result.header = {.settings = io::statistics_settings(capture_sha256, used, camera),
                   .capture = shown,
                   .capture_sha256 = capture_sha256,
                   .facts = frames.facts,
                   .frames = used};
  result.header.key = io::sha256_of(result.header.settings);
  result.sums = frames.sums.content();
  return result;
}

}  // namespace tofgraph::diagnosis
