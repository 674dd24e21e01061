// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file One look at a simulated frame.
#pragma once

#include <span>
#include <string>

namespace tofgraph::report {

/// A frame; images are rows x columns, row by row.
struct PreviewFrame {
  std::string title;
  std::size_t rows = 0, columns = 0;
  std::span<const float> phases;               ///< 4 images, counts
  std::span<const float> distance, amplitude;  ///< m, counts
  std::span<const float> points;               ///< x, y, z of each pixel, optical frame, m; NaN: nothing
};

/// The four phases, amplitude, distance and the cloud in one picture, as the bytes of a PNG.
std::string scene_preview(const PreviewFrame& frame);

}  // namespace tofgraph::report
