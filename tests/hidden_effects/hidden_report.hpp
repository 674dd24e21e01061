// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Report for a campaign with hidden effects.
#pragma once

#include "tests/hidden_effects/campaign.hpp"
#include "tests/program.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <set>
#include <string>
#include <vector>

namespace tofgraph::hidden {

struct HiddenReport {
  nlohmann::json json;
  std::string model;  ///< text of model.yaml
};

/// Hides effects at their typical amplitudes, and runs the search: no fit may end worse than a nested model.
/// @param options of `tofgraph diagnose` @param campaign design and other unusual settings
inline HiddenReport report_of(const std::vector<std::string>& effects, std::uint64_t seed,
                              const std::string& options = "", CampaignOptions campaign = {}) {
  const tests::TemporaryFolder folder;
  campaign.seed = seed;
  campaign.folder = folder.path() / "campaign";
  for (const std::string& effect : effects) campaign.effects.add_text(effect, 1, seed);
  make_campaign(campaign);
  const tests::Outcome outcome = tests::shell(
      "\"$TOFGRAPH\" diagnose --quiet --model campaign/model.yaml --data campaign/campaign.yaml -o found " + options,
      folder.path());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  HiddenReport report{nlohmann::json::parse(tests::read_text(folder.path() / "found/report.json")),
                      tests::read_text(folder.path() / "found/model.yaml")};
  for (const auto& step : report.json.at("trace"))
    EXPECT_NE(step.at("outcome"), "worse than a model that it contains") << step;
  return report;
}

inline std::set<std::string> names_in(const nlohmann::json& report) {
  std::set<std::string> names;
  for (const auto& effect : report.at("effects")) names.insert(effect.at("name"));
  return names;
}

}  // namespace tofgraph::hidden
