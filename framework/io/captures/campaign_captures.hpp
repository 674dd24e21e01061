// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Whether the captures of a campaign are what its conditions say, as far as it shows without their frames.
#pragma once

#include "io/campaign.hpp"

namespace tofgraph::io {

/// What the captures are wanted for.
enum class CapturesFor {
  anything,  ///< what only a gap search needs is a warning
  search     ///< it is an error
};

/// Opens every capture that is there. Another size than the camera's and frames that are not there are mistakes; so is,
/// for a search, what it cannot use: no integration time, other exposures than the four, another camera, the same
/// frames in two conditions. A capture that cannot be read is a mistake, unless it is for a search, which tells it when
/// it reads it.
/// @param document the campaign's file, for the places
void check_captures(const config::Value& document, const Campaign& campaign, CapturesFor purpose,
                    config::Diagnostics& diagnostics);

}  // namespace tofgraph::io
