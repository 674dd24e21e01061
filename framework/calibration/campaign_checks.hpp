// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Checks across the conditions of a campaign of boards: mistakes in what was written, captures of several
/// cameras, boards that were corrected already.
#pragma once

#include "calibration/board_measurement.hpp"
#include "calibration/board_phasors.hpp"
#include "io/campaign.hpp"

#include <string>
#include <vector>

namespace tofgraph::calibration {

/// A condition as its capture shows it.
struct ConditionEvidence {
  io::Condition condition;        ///< completed by the capture
  BoardPhasors::Phasors phasors;  ///< at the places of CampaignChecks; empty: no board was seen
  bool has_amplitude = false, shows_saturation = false;
  double recorded_time = unknown;  ///< s, integration time by the capture
  std::string camera;              ///< by the capture; empty: it does not say
  std::string applied;             ///< to the distance: words
  bool read = false;
};

class CampaignChecks {
 public:
  /// @param campaign, models stay as long as the object
  CampaignChecks(const io::Campaign& campaign, const BoardModels& models);

  /// Medians over blocks of the image, as phasors. @param images those of the condition
  BoardPhasors::Phasors measured(const io::Condition& condition, const MeanImages& images) const;
  /// @param evidence one a condition of the campaign
  /// @param notes what is doubtful is appended @param diagnostics what is wrong, each at its place
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

/// The conditions whose distance was corrected by a stage already, as `applied` of their captures says.
std::vector<const io::Condition*> corrected_by(const io::Campaign& campaign,
                                               const std::vector<ConditionEvidence>& evidence,
                                               const std::string& stage);

}  // namespace tofgraph::calibration
