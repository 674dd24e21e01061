// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Report of an offset calibration.
#pragma once

#include "calibration/campaign_inputs.hpp"
#include "calibration/held_out.hpp"

namespace tofgraph::calibration {

/// @param verdict sentence at the top
report::Page offset_report(const Campaign& campaign, const physics::OffsetTable& table,
                           const std::vector<HeldOut>& axes, const std::string& verdict);

}  // namespace tofgraph::calibration
