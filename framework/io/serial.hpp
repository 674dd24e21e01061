// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The comparison of serial numbers: a calibration or a model belongs to one device.
#pragma once

#include "io/campaign.hpp"

#include <string>
#include <vector>

namespace tofgraph::io {

/// Problem with using what was made for the device `made_for` on data of the device `used_on`, for a message that
/// begins with its name; empty: none, or a serial number is not known.
/// @param data what the data are, in the plural: "the frames"
std::string serial_problem(const std::string& made_for, const std::string& used_on, const std::string& data);

/// The one serial number of a campaign's captures; empty: not recorded. A second one is an error at its condition.
/// @param serials of the captures, one a condition; empty: not recorded
std::string common_serial(const Campaign& campaign, const std::vector<std::string>& serials,
                          config::Diagnostics& diagnostics);

}  // namespace tofgraph::io
