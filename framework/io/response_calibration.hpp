// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Reader of calibrations of the kind `response`, for the profile of a camera.
#pragma once

#include "io/unknown.hpp"

#include <filesystem>
#include <string>

namespace tofgraph::io {

struct ResponseCalibration {
  double contrast = unknown;
  double gain = unknown;  ///< counts m^2/s; NaN: no reflectivity was stated
};

/// @param camera name of its profile @throws ConfigurationError with all errors
ResponseCalibration read_response_calibration(const std::filesystem::path& file, const std::string& camera);

}  // namespace tofgraph::io
