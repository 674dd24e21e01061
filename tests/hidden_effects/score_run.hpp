// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Scoring of one case, from a campaign to a score.
#pragma once

#include "tests/hidden_effects/campaign.hpp"
#include "tests/hidden_effects/score_verdict.hpp"

#include <filesystem>

namespace tofgraph::hidden {

struct Bench {
  std::string program = TOFGRAPH_PROGRAM;
  std::filesystem::path scratch = std::filesystem::temp_directory_path() / "hidden_effects";
  std::size_t every = 1, frames = 4;  ///< only every n-th condition of a design, with this number of frames
  bool keep = false;                  ///< keeps the campaign and the report
  bool again = false;                 ///< tests the found model's predictions on another campaign of the same camera
};

/// Options of a case's campaign; its folder is not set.
CampaignOptions campaign_of(const Case& what);

/// Runs the search on an existing campaign and returns report.json. @param options in addition to the usual ones
/// @throws std::runtime_error if the search fails
nlohmann::json searched(const std::filesystem::path& campaign, const Bench& bench, const std::string& options);

/// Makes the campaign, searches it, compares. @throws std::runtime_error if the search fails
Score run(const Case& what, const Bench& bench);

}  // namespace tofgraph::hidden
