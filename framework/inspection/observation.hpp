// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Mean and noise of each pixel of a recording, the input of all tests of `tofgraph inspect`.
#pragma once

#include "io/camera.hpp"
#include "io/captures/capture.hpp"
#include "io/exposure_order.hpp"

#include <optional>
#include <string>
#include <vector>

namespace tofgraph::inspection {

/// Shares of the pixels of all frames read, 0 to 1.
struct Shares {
  double missing = 0;  ///< zero, negative, NaN or flagged as invalid
  double saturated = 0, wrapped = 0, low_signal = 0;
  double no_ray = 0;  ///< outside the lens model of the profile
};

/// Averages over the first frames of a recording. Images are row by row, lengths in m.
struct Observation {
  io::CameraPtr camera;
  std::string channel;   ///< type of the lengths: depth, range or distance; "points" are used as depths
  bool decoded = false;  ///< the lengths are decoded from taps or phases
  std::size_t width = 0, height = 0, frames = 0;
  double integration_time = 0;    ///< s; NaN: not recorded
  double unambiguous_range = 0;   ///< m; NaN: unknown
  std::vector<double> length;     ///< mean of the valid frames; NaN: none
  std::vector<double> deviation;  ///< standard deviation over time; NaN: fewer than four frames
  std::vector<double> amplitude;  ///< mean, counts; empty: not recorded
  Shares shares;
  std::optional<io::OtherOrder> other_order;        ///< fits the raw images better than the stated exposures
  physics::Exposures stated;                        ///< exposures of the recording, or of the profile
  physics::Exposures exposures;                     ///< used to decode the raw images
  std::vector<physics::Exposures> possible_orders;  ///< rotations of these that agree with the light, these first

  std::size_t pixels() const { return width * height; }
};

/// Reads up to `max_frames` frames. Raw images are decoded, with a better order of the exposures if one was found.
/// @param camera null: that of the capture's profile
/// @param exposures used to decode raw images; null: the stated ones, or better ones if found
/// @throws std::runtime_error if the capture has neither lengths nor raw images, or another size than the camera
Observation observe(const io::CaptureReader& capture, io::CameraPtr camera, std::size_t max_frames = 32,
                    const physics::Exposures* exposures = nullptr);

}  // namespace tofgraph::inspection
