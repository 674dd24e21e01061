// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Points in no order into the pixels of a camera.
#pragma once

#include <tofgraph/plugin.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tofgraph::foreign {

inline constexpr std::size_t no_pixel = static_cast<std::size_t>(-1);

/// The pixel of each point by the lens of the camera: the nearest point of a pixel has it, others have none, as have
/// points outside the image or the lens model. @param points x y z in the optical frame, m
std::vector<std::size_t> pixels_of_points(const tofgraph_camera& camera, const std::vector<float>& points);

/// Values of points at their pixels, NaN (0 for whole numbers) elsewhere. @param per_point values that stand together
template <class T> void place(const std::vector<std::size_t>& pixels, const std::vector<T>& values,
                              std::size_t per_point, T nothing, T* out, std::size_t count) {
  for (std::size_t i = 0; i < count * per_point; ++i) out[i] = nothing;
  for (std::size_t p = 0; p < pixels.size(); ++p) {
    for (std::size_t i = 0; i < per_point && pixels[p] != no_pixel; ++i)
      out[pixels[p] * per_point + i] = values[p * per_point + i];
  }
}

}  // namespace tofgraph::foreign
