// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Calibrations of the kind `intrinsics`, as stages read them.
#pragma once

#include "io/calibration.hpp"

#include <tofgraph/plugin.h>

namespace tofgraph::io {

/// Sets the camera's focal_px, principal_point, skew and distortion. @param camera its name is that of the calibration
/// @returns the serial number of the calibrated device; empty: not stated
/// @throws config::ConfigurationError with every mistake
std::string read_intrinsics_calibration(const std::filesystem::path& file, tofgraph_camera& camera);

}  // namespace tofgraph::io
