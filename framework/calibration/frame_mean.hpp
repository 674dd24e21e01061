// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The mean of the frames of one condition, read once, one frame in memory.
#pragma once

#include "calibration/board.hpp"
#include "io/camera.hpp"
#include "io/captures/recording.hpp"

#include <array>

namespace tofgraph::calibration {

/// Completes a condition from the capture: integration time, time since power-on.
/// @throws std::runtime_error several integration times, an unknown one, another modulation frequency than the camera's
void complete(io::Condition& condition, const io::CaptureReader& capture, const tofgraph_camera& camera);

/// The first and the last frame of a condition in its recording. @param camera that it has to be of
/// @throws std::runtime_error what is wrong with the capture: another size, no frames, other exposures than four of 90
/// degrees
std::array<std::size_t, 2> frames_of(const io::Recording& recording, const io::Condition& condition,
                                     const tofgraph_camera& camera);

/// Averages the condition's frames: of taps and phases the samples, which are decoded then; of decoded frames the
/// distances and amplitudes. Pixels that are bad in the camera's map, not a number or saturated in a frame are left
/// out.
/// @param window pixels to use @param camera four exposures of 90 degrees, its frequency, full well and bad pixels
/// @throws std::runtime_error what is wrong with the capture
MeanImages mean_of(const io::Recording& recording, const io::Condition& condition,
                   const std::vector<std::size_t>& window, const io::Camera& camera);

/// The same of a flat target, where pixels that are unlike their neighbours are left out, too: see
/// keep_like_neighbours().
/// @param modelled m, distance of each pixel of the window by the ideal camera
MeanImages mean_of_flat(const io::Recording& recording, const io::Condition& condition,
                        const std::vector<std::size_t>& window, const std::vector<double>& modelled,
                        const io::Camera& camera);

}  // namespace tofgraph::calibration
