// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Picture of a simulated frame.
#pragma once

#include <tofgraph/physics/exposures.hpp>

#include <span>
#include <string>

namespace tofgraph::report {

/// A frame; images are rows x columns, row by row.
struct PreviewFrame {
  std::string title;
  std::size_t rows = 0, columns = 0;
  physics::Exposures exposures;
  std::span<const float> phases;               ///< an image for each of them, counts
  std::span<const float> distance, amplitude;  ///< m, counts
  std::span<const float> points;               ///< x, y, z of each pixel, optical frame, m; NaN: nothing
};

/// Four of the phases (all where there are no more), amplitude, distance and the cloud in one picture, as the bytes of
/// a PNG.
std::string scene_preview(const PreviewFrame& frame);

}  // namespace tofgraph::report
