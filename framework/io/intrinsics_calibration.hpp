// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Reader of calibrations of the kind `intrinsics`, for stages.
#pragma once

#include "io/calibration.hpp"

#include <tofgraph/plugin.h>

namespace tofgraph::io {

/// Sets focal_px, principal_point, skew and distortion of the camera. @param camera must have the calibration's name
/// @returns the serial number of the calibrated device; empty: not stated
/// @throws config::ConfigurationError with all errors
std::string read_intrinsics_calibration(const std::filesystem::path& file, tofgraph_camera& camera);

}  // namespace tofgraph::io
