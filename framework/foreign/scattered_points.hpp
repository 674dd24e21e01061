// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Assignment of unordered points to the pixels of a camera.
#pragma once

#include <tofgraph/plugin.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tofgraph::foreign {

inline constexpr std::size_t no_pixel = static_cast<std::size_t>(-1);

/// Pixel of each point by projection through the lens. Only the nearest point of each pixel is assigned; others have no
/// pixel, nor have points outside the image or the lens model. @param points x y z in the optical frame, m
std::vector<std::size_t> pixels_of_points(const tofgraph_camera& camera, const std::vector<float>& points);

/// Copies values of points to their pixels; the others become NaN (0 for integers). @param per_point values per point
template <class T> void place(const std::vector<std::size_t>& pixels, const std::vector<T>& values,
                              std::size_t per_point, T nothing, T* out, std::size_t count) {
  for (std::size_t i = 0; i < count * per_point; ++i) out[i] = nothing;
  for (std::size_t p = 0; p < pixels.size(); ++p) {
    for (std::size_t i = 0; i < per_point && pixels[p] != no_pixel; ++i)
      out[pixels[p] * per_point + i] = values[p * per_point + i];
  }
}

}  // namespace tofgraph::foreign
