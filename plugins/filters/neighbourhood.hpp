// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Medians of pixels, and filling of invalid pixels from valid neighbours.
#pragma once

#include <tofgraph/lengths.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

namespace tofgraph {

/// Rejects a window of even side, or larger than the image. @param name, side the parameter and its value
inline void check_window(const tofgraph_channel& image, const std::string& name, std::int64_t side) {
  if (side % 2 == 0) {
    throw ConfigError(name, "is " + std::to_string(side) + ", must be odd, so that the pixel is its centre, e.g. " +
                                name + ": " + std::to_string(side + 1));
  }
  if (static_cast<std::uint64_t>(side) > std::min(image.extent[0], image.extent[1])) {
    throw ConfigError(name, "is " + std::to_string(side) + " pixels, the image has only " +
                                std::to_string(image.extent[0]) + " x " + std::to_string(image.extent[1]));
  }
}

/// Median; for an even number of values the mean of the two middle ones. Reorders the values, which must not be empty
/// or contain NaN.
inline float median_of(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 != 0) return *middle;
  return 0.5F * (*middle + *std::max_element(values.begin(), middle));
}

/// Valid values of the square window around a pixel, clipped by the image. @returns the window's number of pixels
inline std::size_t gather_window(const float* image, std::size_t rows, std::size_t columns, std::size_t row,
                                 std::size_t column, std::size_t radius, std::vector<float>& values) {
  const std::size_t top = row - std::min(row, radius), bottom = std::min(row + radius + 1, rows);
  const std::size_t left = column - std::min(column, radius), right = std::min(column + radius + 1, columns);
  values.clear();
  for (std::size_t r = top; r < bottom; ++r) {
    for (std::size_t c = left; c < right; ++c) {
      if (!std::isnan(image[r * columns + c])) values.push_back(image[r * columns + c]);
    }
  }
  return (bottom - top) * (right - left);
}

/// Replaces an invalid pixel by the median of the valid ones in its window, if at least half of the window is valid,
/// and flags it as filled. Its sigma is the root mean square difference of these from the median: the unknown surface
/// dominates, not the noise.
inline void fill_invalid(const Array<float>& lengths, const Array<float>& deviations, const Array<std::uint16_t>& bits,
                         std::size_t radius) {
  struct Filling {
    std::size_t pixel;
    float length, deviation;
  };
  const std::size_t columns = lengths.columns();
  std::vector<Filling> fillings;  // applied at the end, so that a filled pixel fills no other
  std::vector<float> values;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    if (!std::isnan(lengths[i])) continue;
    const std::size_t all =
        gather_window(lengths.data(), lengths.rows(), columns, i / columns, i % columns, radius, values);
    if (2 * values.size() < all) continue;
    const float middle = median_of(values);
    float squares = 0;
    for (const float v : values) squares += (v - middle) * (v - middle);
    fillings.push_back({i, middle, std::sqrt(squares / static_cast<float>(values.size()))});
  }
  for (const Filling& filling : fillings) {
    lengths[filling.pixel] = filling.length;
    if (deviations) deviations[filling.pixel] = filling.deviation;
    bits[filling.pixel] = static_cast<std::uint16_t>((bits[filling.pixel] & ~flag::invalid) | flag::filled);
  }
}

}  // namespace tofgraph
