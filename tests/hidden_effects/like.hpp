// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Another campaign of the same camera, to compare what a search predicts with what new data show.
#pragma once

#include "tests/hidden_effects/campaign.hpp"

namespace tofgraph::hidden {

/// Options from a campaign's truth.yaml, with the same hidden effects, camera and boards; jitter, noise, order, drift,
/// sessions and residue are drawn from another seed.
/// @throws std::invalid_argument for a file that is no truth, and for the seed of that campaign
CampaignOptions like(const std::filesystem::path& truth, std::uint64_t seed);

/// The same conditions with their distances between those that were: each level goes 0.3 to 0.7 of the way to the next
/// one, the last one back to the one before; what had one distance has one again.
std::vector<io::Condition> between(std::vector<io::Condition> conditions, std::uint64_t seed);

}  // namespace tofgraph::hidden
