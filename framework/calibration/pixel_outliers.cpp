// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/pixel_outliers.hpp"

#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace tofgraph::calibration {
namespace {

constexpr double amplitude_factor = 4;   ///< exceeds the ratio of good pixels on a flat target
constexpr double upper_quartile = 0.75;  ///< bad pixels are mostly dark: up to two thirds of the neighbours may be bad
constexpr double noise_factor = 2;       ///< less has little effect on a mean
constexpr double min_difference = 0.01;  ///< m, likewise

/// Quantile of the neighbours of each pixel of the window. @param keep neighbours to be used
std::vector<double> window_quantiles(const FlatTarget& target, std::span<const double> values,
                                     const std::vector<std::uint8_t>& keep, double share = 0.5) {
  const std::size_t last = target.pixels.empty() ? 0 : *std::ranges::max_element(target.pixels);
  std::vector<double> image((last / target.columns + 1) * target.columns, std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; i < values.size(); ++i)
    if (keep[i] != 0) image[target.pixels[i]] = values[i];
  std::vector<double> quantiles;
  for (const std::size_t pixel : target.pixels)
    quantiles.push_back(neighbour_quantile(image, target.columns, pixel, share));
  return quantiles;
}

/// Differences between the residuals and those of the neighbours, modulo the range; NaN for rejected pixels.
std::vector<double> residual_differences(const FlatTarget& target, const std::vector<std::uint8_t>& keep) {
  std::vector<double> differences = window_quantiles(target, target.residual, keep);
  for (std::size_t i = 0; i < differences.size(); ++i)
    differences[i] = keep[i] != 0 ? std::remainder(target.residual[i] - differences[i], target.range)
                                  : std::numeric_limits<double>::quiet_NaN();
  return differences;
}

}  // namespace

double variance_ratio_at(double freedom, double deviate) {
  const double spread = 2 / (9 * freedom);
  return std::pow(std::max(1 - spread + deviate * std::sqrt(spread), 0.0), 3);
}

double robust_sd(std::span<const double> differences) {
  std::vector<double> sizes;
  for (const double d : differences)
    if (std::isfinite(d)) sizes.push_back(std::abs(d));
  return physics::sd_of_deviations * physics::median(sizes);
}

double neighbour_quantile(std::span<const double> image, std::size_t columns, std::size_t pixel, double share) {
  constexpr std::size_t reach = 2, min_neighbours = 4;
  const std::size_t u = pixel % columns, v = pixel / columns, rows = image.size() / columns;
  std::array<double, (2 * reach + 1) * (2 * reach + 1)> around{};
  std::size_t count = 0;
  for (std::size_t y = v - std::min(v, reach); y <= std::min(v + reach, rows - 1); ++y) {
    for (std::size_t x = u - std::min(u, reach); x <= std::min(u + reach, columns - 1); ++x) {
      const double value = image[y * columns + x];
      if ((x != u || y != v) && std::isfinite(value)) around[count++] = value;
    }
  }
  if (count < min_neighbours) return std::numeric_limits<double>::quiet_NaN();
  const auto place = around.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(count));
  std::nth_element(around.begin(), place, around.begin() + static_cast<std::ptrdiff_t>(count));
  return *place;
}

std::vector<std::uint8_t> keep_like_neighbours(const FlatTarget& target, UnusablePixels& counts) {
  const std::size_t n = target.pixels.size();
  std::vector<std::uint8_t> keep(n, 1);
  const auto reject = [&](std::size_t i, std::size_t& reason) {
    reason += keep[i];
    keep[i] = 0;
  };
  std::vector<double> brightness(n, 1);  // of the neighbours relative to the window, at most 1
  if (!target.amplitude.empty()) {
    const double middle = physics::median(std::vector(target.amplitude.begin(), target.amplitude.end()));
    const std::vector<double> local = window_quantiles(target, target.amplitude, keep, upper_quartile);
    for (std::size_t i = 0; i < n; ++i) {
      const double ratio = target.amplitude[i] / local[i];
      if (ratio * amplitude_factor < 1 || ratio > amplitude_factor) reject(i, counts.amplitude);
      if (local[i] < middle) brightness[i] = std::max(local[i] / middle, 1e-3);
    }
  }
  if (!target.variance.empty()) {
    const std::vector<double> local = window_quantiles(target, target.variance, keep);
    const double limit = std::max(noise_factor * noise_factor, variance_ratio_at(target.freedom, outlier_deviate));
    for (std::size_t i = 0; i < n; ++i)
      if (local[i] > 0 && target.variance[i] > limit * local[i]) reject(i, counts.noisy);
  }
  if (!target.residual.empty()) {
    const std::vector<double> differences = residual_differences(target, keep);
    const double sd = robust_sd(differences);
    for (std::size_t i = 0; i < n; ++i) {
      if (std::abs(differences[i]) > std::max(min_difference, outlier_deviate * sd / brightness[i]))
        reject(i, counts.distance);
    }
  }
  return keep;
}

std::size_t mark_isolated(std::vector<double>& values, std::size_t columns, double noise) {
  constexpr double factor = 3;
  constexpr std::size_t alike = 2;  // similar neighbours: more than two indicate an edge
  const double min_step = std::isfinite(noise) ? outlier_deviate * noise : 0;
  const std::size_t rows = values.size() / columns;
  std::vector<std::size_t> isolated;
  for (std::size_t v = 1; v + 1 < rows; ++v) {
    for (std::size_t u = 1; u + 1 < columns; ++u) {
      std::array<double, 8> around{};
      std::size_t count = 0;
      for (std::size_t y = v - 1; y <= v + 1; ++y) {
        for (std::size_t x = u - 1; x <= u + 1; ++x) {
          const double value = values[y * columns + x];
          if ((x != u || y != v) && std::isfinite(value)) around[count++] = value;
        }
      }
      const double value = values[v * columns + u];
      if (count <= 2 * alike || !std::isfinite(value)) continue;
      std::sort(around.begin(), around.begin() + static_cast<std::ptrdiff_t>(count));
      const double low = around[alike], high = around[count - 1 - alike];
      const bool dark = value * factor < low && low - value > min_step;
      const bool bright = value > factor * high && value - high > min_step;
      if (dark || bright) isolated.push_back(v * columns + u);
    }
  }
  for (const std::size_t i : isolated) values[i] = std::numeric_limits<double>::quiet_NaN();
  return isolated.size();
}

}  // namespace tofgraph::calibration
