// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Plausibility of recorded settings, lengths and clocks. Each doubt is one sentence that names the quantity, the
/// recorded and the expected value, and the likely unit; an empty text means no doubt.
#pragma once

#include <tofgraph/plugin.h>

#include <span>
#include <string>
#include <vector>

namespace tofgraph::io {

/// Doubts about a modulation frequency. @param frequency Hz, NaN: unknown @param camera the expected range is a factor
/// of 100 around its nominal frequency; may be null: 0.1 MHz to 1 GHz
std::string frequency_doubt(double frequency, const tofgraph_camera* camera);

/// Doubts about an integration time. @param time s, NaN: unknown @param camera the expected range is a factor of 10
/// around its valid range; may be null: 1 us to 500 ms
std::string integration_time_doubt(double time, const tofgraph_camera* camera);

/// Doubts about the temperature of a camera. @param temperature K, NaN: unknown; expected: -60 to 120 degC
std::string temperature_doubt(double temperature);

/// Unambiguous range of the lowest known frequency, a lower limit if there are several frequencies; m, NaN: unknown.
/// @param recorded frequency of a frame, Hz, NaN: unknown; ignored if implausible
/// @param camera source of the nominal frequency; may be null
double expected_range(std::span<const tofgraph_exposure> exposures, double recorded, const tofgraph_camera* camera);

/// Doubts about the lengths of a channel. @param lengths of a frame, m; the median of the positive ones is checked
/// @param unambiguous_range m, NaN: unknown. Expected are at most ten times this range, or 1 km if unknown, and at
/// least 5 mm
std::string length_doubt(const std::string& channel, std::vector<float> lengths, double unambiguous_range);

/// Doubts about lengths if 5 % of the positive ones are beyond twice the measuring range of the data sheet, or beyond
/// the unambiguous range if it is between the measuring range and this; where the data sheet is unknown, beyond twice
/// the unambiguous range: recordings with several frequencies exceed it. The largest 1 % must also reach 1.1 times this
/// limit, which an offset may exceed slightly. @param measuring_range m, NaN: unknown
/// @param unambiguous_range m, NaN: unknown
std::string range_doubt(const std::string& channel, std::vector<float> lengths, double measuring_range,
                        double unambiguous_range);

/// Doubts about time stamps and about the time since power on, at most one each: they decrease, are constant, or are
/// closer together than the exposure of a frame. @param camera source of the frame rate; may be null
std::vector<std::string> clock_doubts(std::span<const tofgraph_metadata> frames, const tofgraph_camera* camera);

/// All doubts about the values recorded with each frame, at most one per quantity.
std::vector<std::string> metadata_doubts(std::span<const tofgraph_metadata> frames, const tofgraph_camera* camera);

}  // namespace tofgraph::io
