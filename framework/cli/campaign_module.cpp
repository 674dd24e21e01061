// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Checks that the captures of a campaign agree with the descriptions of its conditions.
#include "cli/campaign.hpp"
#include "io/captures/campaign_captures.hpp"

extern "C" __attribute__((visibility("default"))) int tofgraph_command(const void* given) {
  const auto& arguments = *static_cast<const tofgraph::cli::CampaignArguments*>(given);
  tofgraph::io::check_captures(arguments.campaign, tofgraph::io::CapturesFor::anything, arguments.diagnostics);
  return 0;
}
