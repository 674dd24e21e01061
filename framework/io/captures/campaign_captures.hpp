// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Checks of a campaign's captures against its conditions, without reading their frames.
#pragma once

#include "io/campaign.hpp"
#include "io/captures/capture_facts.hpp"

#include <span>
#include <string>
#include <vector>

namespace tofgraph::io {

/// Purpose of the captures.
enum class CapturesFor {
  anything,  ///< unmet requirements of a gap search are warnings
  search     ///< unmet requirements of a gap search are errors
};

/// Opens every existing capture. A size other than the camera's and missing frames are errors. For a search, captures
/// that it cannot use are errors too: without integration time, with exposures other than the camera's or of several
/// frequencies, of another camera, or with frames that two conditions share. An unreadable capture is an error, except
/// for a search, which reports it while reading. An integration time that differs from that of the condition is a
/// warning, except for a search, which determines it from the data.
void check_captures(const Campaign& campaign, CapturesFor purpose, config::Diagnostics& diagnostics);

/// Difference between the exposures of a capture and of the camera; empty: none, or the capture has decoded frames
/// only, which need not state exposures.
std::string other_exposures(const CaptureFacts& capture, const tofgraph_camera& camera);

/// True if they differ by more than 1 %. @param a, b s; false if one is NaN (unknown)
bool is_other_integration_time(double a, double b);

/// Flags the captures whose integration time differs from that of their condition. Flags none if most of them differ:
/// then the recorder wrote the same value to all files. @param written, recorded s, one per condition; NaN: unknown
std::vector<bool> other_integration_times(std::span<const double> written, std::span<const double> recorded);

/// Warnings about implausible integration times, with the likely cause: all conditions differ from their captures by
/// one large factor, which indicates a wrong unit; single conditions differ; or times are outside the camera's range.
/// @param recorded s, one per condition; NaN: unknown
std::vector<config::Diagnostic> unlikely_integration_times(std::span<const Condition> conditions,
                                                           std::span<const double> recorded,
                                                           const tofgraph_camera& camera);

}  // namespace tofgraph::io
