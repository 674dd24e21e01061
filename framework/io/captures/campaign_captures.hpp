// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Check of a campaign's captures against its conditions, without reading their frames.
#pragma once

#include "io/campaign.hpp"
#include "io/captures/capture_facts.hpp"

#include <span>
#include <string>
#include <vector>

namespace tofgraph::io {

/// Purpose of the captures.
enum class CapturesFor {
  anything,  ///< requirements of a gap search only are warnings
  search     ///< it is an error
};

/// Opens every capture that is there. Another size than the camera's and frames that are not there are mistakes; so is,
/// for a search, what it cannot use: no integration time, other exposures than the camera's, those of several
/// frequencies, another camera, the same frames in two conditions. A capture that cannot be read is a mistake, unless
/// it is for a search, which tells it when it reads it. That a capture says another integration time than its condition
/// is a warning, and nothing for a search, which asks the data.
void check_captures(const Campaign& campaign, CapturesFor purpose, config::Diagnostics& diagnostics);

/// Difference of a capture's exposures from the camera's; empty: none, or it has decoded frames only, which need not
/// state them.
std::string other_exposures(const CaptureFacts& capture, const tofgraph_camera& camera);

/// By more than 1 %. @param a, b s; NaN: not known, and no other one
bool is_other_integration_time(double a, double b);

/// Which captures say another integration time than their conditions: none where most of them do, for that is what a
/// recorder writes into all its files. @param written, recorded s, one a condition; NaN: not known
std::vector<bool> other_integration_times(std::span<const double> written, std::span<const double> recorded);

/// Integration times that are hardly right, each a warning with its likely cause: those of all conditions differ from
/// those of their captures by one large factor, as of another unit; single ones differ; or they are outside of the
/// camera's range. @param recorded s, one a condition; NaN: not known
std::vector<config::Diagnostic> unlikely_integration_times(std::span<const Condition> conditions,
                                                           std::span<const double> recorded,
                                                           const tofgraph_camera& camera);

}  // namespace tofgraph::io
