// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Leads a person through the recording of a plan.
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
  std::uint64_t frames = 0;         ///< per condition; 0: the plan's
  double tolerance = 0.25;          ///< m, see contradiction()
  std::optional<double> alignment;  ///< m, by which the corners of an untilted board may differ; none: not asked
  bool still = false;               ///< records when the board stands still, where it shows that it was moved
  Run run;
  /// A line of the person's; nothing: there will be none any more. @throws Interrupted
  std::function<std::optional<std::string>()> read_line;
  std::function<void(const std::string&)> say;
  /// Waits a moment. @throws Interrupted
  std::function<void()> wait;
};

/// Number of frames of each condition.
inline std::uint64_t frames_of(const Plan& plan, const GuideOptions& options) {
  return options.frames != 0 ? options.frames : plan.frames;
}

/// no_answer: nobody was there to answer. skipped: some conditions are left out.
enum class Outcome { complete, stopped, no_answer, skipped };

class Guide {
 public:
  Guide(const Plan& plan, CampaignFolder& folder, GuideOptions options);

  /// From the first condition that is not recorded to the last. @throws Interrupted
  /// @throws std::runtime_error what the camera or the disk fails with
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
  std::optional<Reference> before_;      ///< the last board, where it was right
  std::optional<std::string> standing_;  ///< board before the camera now
};

}  // namespace tofgraph::recording
