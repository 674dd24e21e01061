// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Plots of the lens report, SVG.
#pragma once

#include "calibration/intrinsics.hpp"

#include <array>
#include <string>

namespace tofgraph::calibration {

std::string uncertainty_map(const Intrinsics& result, double range);
std::string residual_vectors(const Intrinsics& result);
std::string residual_cloud(const Intrinsics& result);
std::string coverage_map(const Intrinsics& result);
std::string distance_residuals(const Intrinsics& result);
/// @param side true: view from the side
std::string boards_from_above(const Intrinsics& result, bool side);
/// First view as recorded, and with the distortion removed.
std::array<std::string, 2> undistorted_preview(const Intrinsics& result);

}  // namespace tofgraph::calibration
