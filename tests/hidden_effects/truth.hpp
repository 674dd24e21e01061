// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The two parts of a campaign: data known to a search, and the hidden truth.
#pragma once

#include "io/condition.hpp"
#include "tests/hidden_effects/campaign.hpp"

#include <map>
#include <string>

namespace tofgraph::hidden {

/// Profile of the test bench's camera, with other exposures than the original. @throws std::runtime_error if the
/// project's own profile is not found
void write_camera(const std::filesystem::path& file, const Camera& camera);

/// The starting model: the light's form, no effects.
void write_model(const std::filesystem::path& file, const CampaignOptions& options);
/// Everything hidden or drawn, in SI.
void write_truth(const std::filesystem::path& file, const CampaignOptions& options, const Physics& physics,
                 const std::vector<io::Condition>& conditions, const std::vector<View>& views,
                 const DrawnClutter& clutter);

const char* name_of(NoiseKind noise);
const char* name_of(Light light);
const char* name_of(Output output);
const char* name_of(Order order);
/// Conversions for command lines and files.
const std::map<std::string, Output>& output_names();
const std::map<std::string, Order>& order_names();

}  // namespace tofgraph::hidden
