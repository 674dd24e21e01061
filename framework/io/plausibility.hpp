// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Plausibility of recorded settings, lengths and clocks. Each doubt is one sentence that names the quantity, the
/// recorded and the expected value, and the likely unit; an empty text means that there is no doubt.
#pragma once

#include <tofgraph/plugin.h>

#include <span>
#include <string>
#include <vector>

namespace tofgraph::io {

/// Doubts about a modulation frequency. @param frequency Hz, NaN: unknown @param camera its nominal frequency is
/// expected within a factor of 100; may be null: 0.1 MHz to 1 GHz is expected
std::string frequency_doubt(double frequency, const tofgraph_camera* camera);

/// Doubts about an integration time. @param time s, NaN: unknown @param camera its valid range is expected within a
/// factor of 10; may be null: 1 us to 500 ms is expected
std::string integration_time_doubt(double time, const tofgraph_camera* camera);

/// Doubts about the temperature of a camera. @param temperature K, NaN: unknown; -60 to 120 degC is expected
std::string temperature_doubt(double temperature);

/// Unambiguous range of the lowest frequency that is known, as several frequencies reach farther than each of them; m,
/// NaN: unknown. @param recorded frequency of a frame, Hz, NaN: unknown; an implausible one does not count
/// @param camera for its frequency; may be null
double expected_range(std::span<const tofgraph_exposure> exposures, double recorded, const tofgraph_camera* camera);

/// Doubts about the lengths of a channel. @param lengths of a frame, m, of which the median of the positive ones counts
/// @param unambiguous_range m, NaN: unknown. Up to ten times as much is expected, or 1 km where it is unknown, and 5 mm
/// at least
std::string length_doubt(const std::string& channel, std::vector<float> lengths, double unambiguous_range);

/// Doubts about time stamps and about the time since power on, at most one for each: they run back, stand still, or
/// follow each other faster than the frames can be exposed. @param camera for its frame rate; may be null
std::vector<std::string> clock_doubts(std::span<const tofgraph_metadata> frames, const tofgraph_camera* camera);

/// All doubts about what is recorded with each frame, at most one for each quantity.
std::vector<std::string> metadata_doubts(std::span<const tofgraph_metadata> frames, const tofgraph_camera* camera);

}  // namespace tofgraph::io
