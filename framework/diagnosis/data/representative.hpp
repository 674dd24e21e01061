// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Settings of conditions, and a choice of conditions that represents all settings of a large campaign.
#pragma once

#include "io/condition.hpp"

#include <cstddef>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// All settings of a condition; equal for repeated measurements.
std::string settings_of(const io::Condition& condition);

/// Conditions that represent a campaign: those with equal settings apart from the distance form a group, and the groups
/// take turns, each next with distances far from its earlier ones. If there are more groups than turns, those with the
/// rarest levels come first. A share of the conditions repeats others, if the campaign has repetitions. Independent of
/// the order in the file.
/// @returns `count` indices, or those of all conditions if there are no more; ascending
std::vector<std::size_t> representative_conditions(const std::vector<io::Condition>& conditions, std::size_t count);

}  // namespace tofgraph::diagnosis
