// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The two sides of a campaign: what a search is told, and what it is not.
#pragma once

#include "io/condition.hpp"
#include "tests/hidden_effects/campaign.hpp"

#include <map>
#include <string>

namespace tofgraph::hidden {

/// The profile of the camera that the bench is of, with other exposures than it has.
/// @throws std::runtime_error where the project's own profile is not found
void write_camera(const std::filesystem::path& file, const Camera& camera);

/// The starting model: the light's form, no effects.
void write_model(const std::filesystem::path& file, const CampaignOptions& options);
/// All that was hidden or drawn, in SI.
void write_truth(const std::filesystem::path& file, const CampaignOptions& options, const Physics& physics,
                 const std::vector<io::Condition>& conditions, const std::vector<View>& views,
                 const DrawnClutter& clutter);

const char* name_of(NoiseKind noise);
const char* name_of(Light light);
const char* name_of(Output output);
const char* name_of(Order order);
/// For command lines and files.
const std::map<std::string, Output>& output_names();
const std::map<std::string, Order>& order_names();

}  // namespace tofgraph::hidden
