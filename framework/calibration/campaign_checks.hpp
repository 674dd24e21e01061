// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Checks across the conditions of a board campaign: wrong entries, captures of several cameras, boards that are
/// already corrected.
#pragma once

#include "calibration/board_measurement.hpp"
#include "calibration/board_phasors.hpp"
#include "io/campaign.hpp"

#include <string>
#include <vector>

namespace tofgraph::calibration {

/// Properties of a condition according to its capture.
struct ConditionEvidence {
  io::Condition condition;        ///< completed from the capture
  BoardPhasors::Phasors phasors;  ///< at the positions of CampaignChecks; empty: no board was seen
  bool has_amplitude = false, shows_saturation = false;
  double recorded_time = unknown;  ///< s, integration time stated by the capture
  std::string camera;              ///< stated by the capture; empty: not stated
  std::string applied;             ///< to the distance: words
  bool read = false;
};

class CampaignChecks {
 public:
  /// @param campaign, models must outlive this object
  CampaignChecks(const io::Campaign& campaign, const BoardModels& models);

  /// Medians over blocks of the image, as phasors. @param images those of the condition
  BoardPhasors::Phasors measured(const io::Condition& condition, const MeanImages& images) const;
  /// @param evidence one per condition of the campaign
  /// @param notes receives doubts @param diagnostics receives errors, each at its position
  void check(const std::vector<ConditionEvidence>& evidence, std::vector<std::string>& notes,
             config::Diagnostics& diagnostics) const;

 private:
  BoardPhasors::Phasors ideal(const io::Condition& condition) const;
  void check_entries(const std::vector<ConditionEvidence>& evidence, config::Diagnostics& diagnostics) const;
  void check_cameras(const std::vector<ConditionEvidence>& evidence, config::Diagnostics& diagnostics) const;
  void check_applied(const std::vector<ConditionEvidence>& evidence, config::Diagnostics& diagnostics) const;

  const io::Campaign& campaign_;
  const tofgraph_camera& camera_;
  const BoardModels& models_;
};

/// Conditions whose distance is already corrected by a stage, according to `applied` of their captures.
std::vector<const io::Condition*> corrected_by(const io::Campaign& campaign,
                                               const std::vector<ConditionEvidence>& evidence,
                                               const std::string& stage);

}  // namespace tofgraph::calibration
