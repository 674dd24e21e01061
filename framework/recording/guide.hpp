// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Guides a user through the recording of a plan.
#pragma once

#include "recording/campaign_folder.hpp"
#include "recording/look.hpp"
#include "recording/plan.hpp"

#include <functional>
#include <optional>
#include <string>

namespace tofgraph::recording {

struct GuideOptions {
  CameraRequest camera;
  graph::GraphOptions graph;
  std::uint64_t frames = 0;         ///< per condition; 0: as in the plan
  double tolerance = 0.25;          ///< m, see contradiction()
  std::optional<double> alignment;  ///< m, limit of the difference between the corners of an untilted board
  bool still = false;               ///< records once the board stands still, if its move can be detected
  Run run;
  /// Reads a line from the user; nothing at the end of the input. @throws Interrupted
  std::function<std::optional<std::string>()> read_line;
  std::function<void(const std::string&)> print_message;
  /// Waits briefly. @throws Interrupted
  std::function<void()> wait;
};

/// Number of frames of each condition.
inline std::uint64_t frames_of(const Plan& plan, const GuideOptions& options) {
  return options.frames != 0 ? options.frames : plan.frames;
}

/// no_answer: the input ended. skipped: some conditions were left out.
enum class Outcome { complete, stopped, no_answer, skipped };

class Guide {
 public:
  Guide(const Plan& plan, CampaignFolder& folder, GuideOptions options);

  /// Records the conditions that are still missing, in order. @throws Interrupted
  /// @throws std::runtime_error for an error of the camera or the disk
  Outcome run();

 private:
  enum class Answer { record, skip, stop, none };

  Answer set_up(std::size_t condition);
  Answer ask(std::size_t condition);
  Answer wait_until_still(std::size_t condition);
  void record(std::size_t condition);
  std::string record_once(std::size_t condition) const;
  Seen look_at(std::size_t condition) const;
  std::string wrong_with(const Seen& seen, std::size_t condition) const;
  CameraRequest camera_for(std::size_t condition) const;
  std::uint64_t frames() const { return frames_of(plan_, options_); }

  const Plan& plan_;
  CampaignFolder& folder_;
  GuideOptions options_;
  double unambiguous_range_;
  std::optional<Reference> before_;      ///< the last board that was accepted
  std::optional<std::string> standing_;  ///< set-up now before the camera
};

}  // namespace tofgraph::recording
