// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Depth and reflectivity of an image, averaged over pixels of the same surface.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace tofgraph {

/// Two images with a border of NaN, so that windows need no case of their own at the image's edge.
class Surface {
 public:
  void resize(std::size_t rows, std::size_t columns) {
    if (rows == rows_ && columns == columns_) return;
    rows_ = rows;
    columns_ = columns;
    stride_ = columns + 2 * border;
    for (std::vector<float>* image : {&depth_, &reflectivity_, &mean_depth_, &mean_reflectivity_})
      image->assign((rows + 2 * border) * stride_, std::numeric_limits<float>::quiet_NaN());
  }
  float* depth(std::size_t row) { return &depth_[(row + border) * stride_ + border]; }
  float* reflectivity(std::size_t row) { return &reflectivity_[(row + border) * stride_ + border]; }

  /// Means over a square of pixels whose depth and reflectivity are near the middle's, first along rows, then along
  /// columns. @param window its side, odd, at most 2 border + 1 @param by_reflectivity whether that is compared too
  void average(std::size_t window, bool by_reflectivity) {
    const auto half = static_cast<std::ptrdiff_t>(window / 2);
    const float limit = by_reflectivity ? same_reflectivity : std::numeric_limits<float>::infinity();
    average_along(1, half, limit, depth_, reflectivity_, mean_depth_, mean_reflectivity_);
    average_along(static_cast<std::ptrdiff_t>(stride_), half, limit, mean_depth_, mean_reflectivity_, depth_,
                  reflectivity_);
  }

 private:
  static constexpr std::size_t border = 7;
  static constexpr float same_depth = 0.03F, same_reflectivity = 0.25F;  ///< relative to the pixel's own

  /// @param step from one neighbour to the next
  void average_along(std::ptrdiff_t step, std::ptrdiff_t half, float limit, const std::vector<float>& depth,
                     const std::vector<float>& reflectivity, std::vector<float>& mean_depth,
                     std::vector<float>& mean_reflectivity) const {
    sum_z_.resize(columns_);
    sum_r_.resize(columns_);
    count_.resize(columns_);
    for (std::size_t row = 0; row < rows_; ++row) {
      const std::size_t first = (row + border) * stride_ + border;
      const float *z = &depth[first], *r = &reflectivity[first];
      float *sum_z = sum_z_.data(), *sum_r = sum_r_.data(), *count = count_.data();
      std::copy_n(z, columns_, sum_z);
      std::copy_n(r, columns_, sum_r);
      std::fill_n(count, columns_, 1.0F);
      for (std::ptrdiff_t k = -half; k <= half; ++k) {
        if (k == 0) continue;
        const float *beside_z = z + k * step, *beside_r = r + k * step;
        for (std::size_t u = 0; u < columns_; ++u) {
          const bool near = std::abs(beside_z[u] - z[u]) <= same_depth * z[u];
          const bool alike = std::abs(beside_r[u] - r[u]) <= limit * r[u];
          const bool same = near & alike;
          sum_z[u] += same ? beside_z[u] : 0.0F;
          sum_r[u] += same ? beside_r[u] : 0.0F;
          count[u] += same ? 1.0F : 0.0F;
        }
      }
      for (std::size_t u = 0; u < columns_; ++u) {
        const float share = 1.0F / count[u];
        mean_depth[first + u] = sum_z[u] * share;
        mean_reflectivity[first + u] = sum_r[u] * share;
      }
    }
  }

  std::size_t rows_ = 0, columns_ = 0, stride_ = 0;
  std::vector<float> depth_, reflectivity_, mean_depth_, mean_reflectivity_;
  mutable std::vector<float> sum_z_, sum_r_, count_;
};

}  // namespace tofgraph
