// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Mean of the frames of one condition, read once with one frame in memory.
#pragma once

#include "calibration/board_measurement.hpp"
#include "io/camera.hpp"
#include "io/captures/recording.hpp"
#include "io/captures/statistics_file.hpp"

#include <array>
#include <string>
#include <variant>

namespace tofgraph::calibration {

/// Completes a condition from the capture: integration time, time since power-on, temperature.
/// @throws std::runtime_error for missing frames, several or unknown integration times, or a modulation frequency
/// unlike the camera's
void complete(io::Condition& condition, const io::CaptureReader& capture, const tofgraph_camera& camera);

/// First and last frame of a condition in its recording. @param camera expected camera
/// @throws std::runtime_error naming the problem with the capture: another size, no frames, exposures other than four
/// of 90 degrees
std::array<std::size_t, 2> frames_of(const io::Recording& recording, const io::Condition& condition,
                                     const tofgraph_camera& camera);

/// Averages the condition's frames: the samples of taps and phases, which are decoded afterwards, or the distances and
/// amplitudes of decoded frames. Pixels that are bad in the camera's map, not a number or saturated in a frame are
/// excluded.
/// @param window pixels to use @param camera four exposures of 90 degrees, its frequency, full well and bad pixels
/// @throws std::runtime_error naming the problem with the capture
MeanImages mean_of(const io::Recording& recording, const io::Condition& condition,
                   const std::vector<std::size_t>& window, const io::Camera& camera);

/// Frames of a flat target: a capture, or the statistics that `tofgraph reduce` made from it.
class BoardFrames {
 public:
  /// @throws std::runtime_error naming the problem with the file, among them statistics of decoded frames, which
  /// contain no sums of distances
  BoardFrames(const io::Condition& condition, const io::Camera& camera);

  /// The condition, completed from the capture.
  const io::Condition& condition() const { return condition_; }
  const io::CaptureHeader& header() const;
  /// Integration time stated by the capture, s; NaN: none.
  double recorded_time() const;
  /// Corrections already applied to its distances; "": none.
  std::string applied() const;

  /// As mean_of(), but also excludes pixels that differ from their neighbours, see keep_like_neighbours(). Results from
  /// a capture and from its statistics are bit-identical.
  /// @param modelled m, distance of each pixel of the window by the ideal camera
  /// @throws std::runtime_error naming the problem with the capture
  MeanImages mean(const std::vector<std::size_t>& window, const std::vector<double>& modelled) const;

 private:
  const io::Camera& camera_;
  io::Condition condition_;
  std::variant<io::Recording, io::Statistics> frames_;
};

}  // namespace tofgraph::calibration
