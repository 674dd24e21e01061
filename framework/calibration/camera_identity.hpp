// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Check that the captures of a calibration are of one camera.
#pragma once

#include "io/campaign.hpp"

#include <exception>
#include <string>
#include <vector>

namespace tofgraph::calibration {

/// Camera stated by a capture; empty: none.
struct CameraSeen {
  std::string camera, serial;
};

/// Reports two serial numbers as an error, and other camera names as a note. @param seen one per condition
/// @returns the serial number; empty: not recorded
std::string check_one_camera(const io::Campaign& campaign, const std::vector<CameraSeen>& seen,
                             std::vector<std::string>& notes, config::Diagnostics& diagnostics);

/// Position of a condition in its file; for a table row its beginning.
config::Position place_of(const io::Condition& condition);

/// `the capture a.h5 has no frames`: the file is named once, even if the problem names it too.
std::string capture_problem(const io::Condition& condition, const std::exception& problem);

}  // namespace tofgraph::calibration
