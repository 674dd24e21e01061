// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Calibrations of the kind `noise`, as the decoders read them.
#pragma once

#include <tofgraph/physics/four_phase.hpp>

#include <filesystem>
#include <string>

namespace tofgraph::io {

struct NoiseCalibration {
  physics::TapNoise noise;
  std::string serial;  ///< camera's; empty: not stated
};

/// @param camera the name of its profile @throws ConfigurationError with every mistake
NoiseCalibration read_noise_calibration(const std::filesystem::path& file, const std::string& camera);

}  // namespace tofgraph::io
