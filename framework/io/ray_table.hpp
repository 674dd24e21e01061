// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Tables of rays: the viewing direction of each pixel, from a file.
#pragma once

#include "config/document.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace tofgraph::io {

struct RayTable {
  std::vector<float> rays;         ///< height x width x 3, unit vectors in the optical frame; NaN: none
  std::array<double, 2> focal{};   ///< px, of the best-fitting pinhole
  std::array<double, 2> centre{};  ///< px, likewise
};

/// Reads `rays: FILE` or `rays: {file, dataset, as}`, an array of .npy, HDF5 or CSV, row-major over the pixels: three
/// numbers per pixel are directions of any length, two are tangents x/z and y/z or the angles with these tangents, as
/// stated by `as`. Directions that are 0, not finite, or point backwards are invalid.
/// @returns false after an error
bool read_ray_table(const config::Value& value, std::uint32_t width, std::uint32_t height, RayTable& table,
                    config::Diagnostics& diagnostics);

}  // namespace tofgraph::io
