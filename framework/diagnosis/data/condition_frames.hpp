// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The frames of a condition as sums over each pixel: from its capture, or from a statistics file made of it.
#pragma once

#include "diagnosis/data/superpixels.hpp"
#include "io/camera.hpp"
#include "io/condition.hpp"

#include <string>

namespace tofgraph::diagnosis {

/// Sums over the frames of a condition, from whichever file its `capture` is.
struct ConditionFrames {
  io::CaptureFacts facts;  ///< of the capture
  FrameSums sums;          ///< without pixels that are bad in the camera's map
};

/// @throws std::runtime_error when the file cannot be read, has too few frames, or is a statistics file made with other
/// settings than the condition and the camera have now
ConditionFrames read_frames(const io::Condition& condition, const io::Camera& camera);

/// All that the sums depend on, one "name value" a line: the capture's content, the frames, and what is used of the
/// profile. Positions of boards, reflectivities and the like are not among them: they may be corrected afterwards.
std::string statistics_settings(const std::string& capture_sha256, const std::array<std::uint64_t, 2>& frames,
                                const io::Camera& camera);

/// Statistics of a condition's capture, one frame in memory at a time.
/// @param shown path of the capture as reports name it @param capture_sha256 of its bytes
/// @throws std::runtime_error as read_frames
io::Statistics reduce_capture(const io::Condition& condition, const io::Camera& camera, const std::string& shown,
                              const std::string& capture_sha256);

/// First and last frame of a condition. @param frames of its capture @throws std::runtime_error when one is not there
std::array<std::uint64_t, 2> used_frames(const io::Condition& condition, std::uint64_t frames);

}  // namespace tofgraph::diagnosis
