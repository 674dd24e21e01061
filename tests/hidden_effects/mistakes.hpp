// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Campaign files with one error, for the check that precedes the gap search.
#pragma once

#include "io/campaign.hpp"

#include <array>
#include <random>
#include <string_view>
#include <vector>

namespace tofgraph::hidden {

enum class Mistake { factor_ten, distance, swapped, target, integration_time };
inline constexpr std::array<std::string_view, 5> mistake_names = {
    "a distance times or through ten", "a distance wrong by 13 % to 100 %", "two captures swapped", "another target",
    "another integration time"};

/// Makes one entry of a campaign wrong, at random. @returns the conditions that are then wrong; empty if the campaign
/// has no alternative value
std::vector<std::size_t> make_mistake(io::Campaign& campaign, Mistake mistake, std::mt19937_64& random);

}  // namespace tofgraph::hidden
