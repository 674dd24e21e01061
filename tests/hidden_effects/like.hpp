// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Another campaign of the same camera, for comparing the predictions of a search with new data.
#pragma once

#include "tests/hidden_effects/campaign.hpp"

namespace tofgraph::hidden {

/// Options from a campaign's truth.yaml, with the same hidden effects, camera and boards; jitter, noise, order, drift,
/// sessions and residual are drawn from another seed.
/// @throws std::invalid_argument for a file that is no truth, and for the seed of that campaign
CampaignOptions like(const std::filesystem::path& truth, std::uint64_t seed);

/// The same conditions with distances between the original ones: each level moves by 0.3 to 0.7 of the way to the next
/// one, the last one towards the previous one; conditions at a common distance keep a common distance.
std::vector<io::Condition> between(std::vector<io::Condition> conditions, std::uint64_t seed);

}  // namespace tofgraph::hidden
