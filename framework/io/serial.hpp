// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Comparison of serial numbers: a calibration or a model is valid for one device only.
#pragma once

#include "io/campaign.hpp"

#include <string>
#include <vector>

namespace tofgraph::io {

/// Problem with using something made for the device `made_for` on data of the device `used_on`, for a message that
/// begins with its name; empty: none, or a serial number is unknown.
/// @param data noun for the data, in the plural: "the frames"
std::string serial_problem(const std::string& made_for, const std::string& used_on, const std::string& data);

/// Serial number common to a campaign's captures; empty: not recorded. A different one is an error at its condition.
/// @param serials of the captures, one per condition; empty: not recorded
std::string common_serial(const Campaign& campaign, const std::vector<std::string>& serials,
                          config::Diagnostics& diagnostics);

}  // namespace tofgraph::io
