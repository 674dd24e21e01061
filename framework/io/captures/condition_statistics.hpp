// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Frames of a condition and the values that its capture states; the settings on which sums over these frames
/// depend, and a statistics file checked against them.
#pragma once

#include "io/camera.hpp"
#include "io/captures/statistics_file.hpp"
#include "io/condition.hpp"

#include <array>
#include <cstdint>
#include <string>

namespace tofgraph::io {

/// First and last frame of a condition. @param frames of its capture @throws std::runtime_error if one does not exist,
/// or the capture has none
std::array<std::uint64_t, 2> used_frames(const Condition& condition, std::uint64_t frames);

/// @throws std::runtime_error if frames of a condition have several integration times, because these cannot be averaged
void check_one_integration_time(const CaptureReader& capture, const std::array<std::uint64_t, 2>& frames);

/// Sets values that a condition does not state: integration time, time since power-on, temperature.
/// @param capture facts with the metadata of the condition's first frame
/// @throws std::runtime_error if the integration time is unknown, or if the modulation frequency is not the camera's
void complete(Condition& condition, const CaptureFacts& capture, const tofgraph_camera& camera);

/// All settings on which the sums depend, one "name value" per line: the capture's hash, the frames, and the used parts
/// of the profile. Board positions, reflectivities and similar values are excluded, since they may be corrected later.
std::string statistics_settings(const std::string& capture_sha256, const std::array<std::uint64_t, 2>& frames,
                                const Camera& camera);

/// Reads the statistics file of a condition.
/// @throws std::runtime_error if it is damaged, or was made with settings that differ from the present ones of the
/// condition and the camera
Statistics read_statistics(const Condition& condition, const Camera& camera);

}  // namespace tofgraph::io
