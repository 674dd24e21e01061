// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Calibrations of the kind `response`, as a camera's profile takes them.
#pragma once

#include "io/unknown.hpp"

#include <filesystem>
#include <string>

namespace tofgraph::io {

struct ResponseCalibration {
  double contrast = unknown;
  double gain = unknown;  ///< counts m^2/s; NaN: no reflectivity was stated
};

/// @param camera the name of its profile @throws ConfigurationError with every mistake
ResponseCalibration read_response_calibration(const std::filesystem::path& file, const std::string& camera);

}  // namespace tofgraph::io
