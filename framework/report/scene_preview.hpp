// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Picture of a simulated frame.
#pragma once

#include <tofgraph/physics/exposures.hpp>

#include <span>
#include <string>

namespace tofgraph::report {

/// Frame to show; images are rows x columns, row-major.
struct PreviewFrame {
  std::string title;
  std::size_t rows = 0, columns = 0;
  physics::Exposures exposures;
  std::span<const float> phases;               ///< one image for each phase, counts
  std::span<const float> distance, amplitude;  ///< m, counts
  std::span<const float> points;               ///< x, y, z of each pixel, optical frame, m; NaN: no surface
};

/// Picture of up to four of the phases, the amplitude, the distance and the point cloud, as the bytes of a PNG
/// file.
std::string scene_preview(const PreviewFrame& frame);

}  // namespace tofgraph::report
