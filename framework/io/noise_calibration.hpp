// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Reader of calibrations of the kind `noise`, for decoders.
#pragma once

#include <tofgraph/physics/four_phase.hpp>

#include <filesystem>
#include <string>

namespace tofgraph::io {

struct NoiseCalibration {
  physics::TapNoise noise;
  std::string serial;  ///< of the camera; empty: not stated
};

/// @param camera name of its profile @throws ConfigurationError with all errors
NoiseCalibration read_noise_calibration(const std::filesystem::path& file, const std::string& camera);

}  // namespace tofgraph::io
