// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A calibration is of one camera.
#pragma once

#include "io/campaign.hpp"

#include <exception>
#include <string>
#include <vector>

namespace tofgraph::calibration {

/// Camera that a capture states; empty: none.
struct CameraSeen {
  std::string camera, serial;
};

/// Two serials are a mistake, captures of a camera of another name are noted. @param seen one a condition
/// @returns the serial; empty: not recorded
std::string check_one_camera(const io::Campaign& campaign, const std::vector<CameraSeen>& seen,
                             std::vector<std::string>& notes, config::Diagnostics& diagnostics);

/// Position of a condition in its file; of a table's row its beginning.
config::Position place_of(const io::Condition& condition);

/// `the capture a.h5 has no frames`: the file is named once, whether or not the problem names it.
std::string capture_problem(const io::Condition& condition, const std::exception& problem);

}  // namespace tofgraph::calibration
