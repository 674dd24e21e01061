// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Estimation of an image's noise from the image itself: by medians, so that a few edges or moving pixels have no
/// influence.
#pragma once

#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace tofgraph {

/// Second differences along the rows, (x[i-1] - 2 x[i] + x[i+1]) / sqrt(6): they keep the standard deviation of noise
/// that is independent from pixel to pixel, and remove slanted surfaces. NaN if any of the three pixels is NaN, and in
/// the first and last column.
inline void second_differences(const float* image, std::size_t rows, std::size_t columns, std::vector<float>& result) {
  result.assign(rows * columns, std::numeric_limits<float>::quiet_NaN());
  constexpr float scale = 0.40824829F;
  for (std::size_t r = 0; r < rows; ++r) {
    const float* row = image + r * columns;
    for (std::size_t c = 1; c + 1 < columns; ++c)
      result[r * columns + c] = scale * (row[c - 1] - 2 * row[c] + row[c + 1]);
  }
}

/// Standard deviation of normal values with mean 0, from the median of absolute values; NaN if empty. Reorders them.
inline float robust_deviation(std::vector<float>& values) {
  for (float& value : values) value = std::abs(value);
  return static_cast<float>(physics::sd_of_deviations) * physics::median(values);
}

/// Standard deviation of residuals in square tiles of the image; 0 for a tile without residuals.
class TileNoise {
 public:
  void estimate(const std::vector<float>& residuals, std::size_t rows, std::size_t columns) {
    across_ = (columns + side - 1) / side;
    deviations_.clear();
    counts_.clear();
    for (std::size_t top = 0; top < rows; top += side) {
      for (std::size_t left = 0; left < columns; left += side) {
        values_.clear();
        for (std::size_t r = top; r < std::min(top + side, rows); ++r) {
          for (std::size_t c = left; c < std::min(left + side, columns); ++c) {
            if (std::isfinite(residuals[r * columns + c])) values_.push_back(residuals[r * columns + c]);
          }
        }
        counts_.push_back(values_.size());
        deviations_.push_back(values_.empty() ? 0 : robust_deviation(values_));
      }
    }
  }
  float at(std::size_t row, std::size_t column) const { return deviations_[tile(row, column)]; }
  /// Number of residuals in the tile of a pixel.
  std::size_t count(std::size_t row, std::size_t column) const { return counts_[tile(row, column)]; }

 private:
  static constexpr std::size_t side = 16;  // px
  std::size_t tile(std::size_t row, std::size_t column) const { return row / side * across_ + column / side; }

  std::size_t across_ = 0;
  std::vector<float> deviations_, values_;
  std::vector<std::size_t> counts_;
};

/// Noise model: variance as a function of the amplitude, constant + slope x amplitude (read noise and shot noise).
struct NoiseLaw {
  double constant = 0, slope = 0;  ///< neither is negative

  double variance(double amplitude) const { return constant + slope * amplitude; }
};

/// Residual with mean 0, and the amplitude of its pixel.
struct Residual {
  float amplitude, value;
};

/// Fits the model to the robust variances of up to 32 groups of residuals of similar amplitude, by least squares with
/// weights from the model itself. Reorders the residuals, which must not be empty.
inline NoiseLaw fit_noise_law(std::vector<Residual>& residuals) {
  std::ranges::sort(residuals, {}, &Residual::amplitude);
  const std::size_t groups = std::clamp<std::size_t>(residuals.size() / 200, 1, 32);
  std::vector<std::array<double, 2>> points;  // amplitude, variance
  std::vector<float> values;
  for (std::size_t g = 0; g < groups; ++g) {
    const std::size_t begin = g * residuals.size() / groups, end = (g + 1) * residuals.size() / groups;
    values.clear();
    for (std::size_t i = begin; i < end; ++i) values.push_back(residuals[i].value);
    const double deviation = robust_deviation(values);
    points.push_back({residuals[(begin + end) / 2].amplitude, deviation * deviation});
  }
  double mean = 0;
  for (const auto& [x, y] : points) mean += y / static_cast<double>(points.size());
  NoiseLaw law{mean, 0};
  for (int repeat = 0; repeat < 4 && mean > 0; ++repeat) {
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (const auto& [x, y] : points) {
      const double weight = 1 / (law.variance(x) * law.variance(x));
      n += weight, sx += weight * x, sy += weight * y, sxx += weight * x * x, sxy += weight * x * y;
    }
    const double determinant = n * sxx - sx * sx;
    NoiseLaw next{sy / n, 0};
    if (determinant > 1e-9 * n * sxx) next = {(sxx * sy - sx * sxy) / determinant, (n * sxy - sx * sy) / determinant};
    if (next.slope < 0) next = {sy / n, 0};
    if (next.constant < 0) next = {0, sxy / sxx};
    law = next;
  }
  return law;
}

}  // namespace tofgraph
