// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file One-dimensional interpolation that introduces no extrema between its points.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <utility>
#include <vector>

namespace tofgraph::physics {

/// Piecewise cubic Hermite interpolation after Fritsch and Butland (1984), as in PCHIP: it passes through its points,
/// has a continuous slope, and is monotonic wherever they are. Beyond the end points it extrapolates linearly.
class MonotoneCurve {
 public:
  MonotoneCurve() = default;
  /// @param x strictly increasing, at least one @param y as many as x
  /// @throws std::invalid_argument otherwise
  MonotoneCurve(std::vector<double> x, std::vector<double> y) : x_(std::move(x)), y_(std::move(y)) {
    const bool rising = std::ranges::adjacent_find(x_, std::ranges::greater_equal()) == x_.end();
    if (x_.empty() || x_.size() != y_.size() || !rising)
      throw std::invalid_argument("a curve needs points whose x rises, and as many y");
    slope_.assign(x_.size(), 0);
    if (x_.size() < 2) return;
    slope_.front() = secant(0);
    slope_.back() = secant(x_.size() - 2);
    for (std::size_t i = 1; i + 1 < x_.size(); ++i) slope_[i] = inner_slope(i);
  }

  double first() const { return x_.front(); }
  double last() const { return x_.back(); }
  std::size_t size() const { return x_.size(); }

  double operator()(double x) const {
    if (x <= x_.front()) return y_.front() + slope_.front() * (x - x_.front());
    if (x >= x_.back()) return y_.back() + slope_.back() * (x - x_.back());
    const auto i = static_cast<std::size_t>(std::ranges::upper_bound(x_, x) - x_.begin()) - 1;
    const double width = x_[i + 1] - x_[i], t = (x - x_[i]) / width, rest = 1 - t;
    return rest * rest * ((1 + 2 * t) * y_[i] + t * width * slope_[i]) +
           t * t * ((1 + 2 * rest) * y_[i + 1] - rest * width * slope_[i + 1]);
  }

 private:
  double secant(std::size_t i) const { return (y_[i + 1] - y_[i]) / (x_[i + 1] - x_[i]); }

  /// Weighted harmonic mean of the neighbouring secants; 0 at an extremum.
  double inner_slope(std::size_t i) const {
    const double before = secant(i - 1), after = secant(i);
    if (!(before * after > 0)) return 0;
    const double left = x_[i] - x_[i - 1], right = x_[i + 1] - x_[i];
    const double w1 = 2 * right + left, w2 = right + 2 * left;
    return (w1 + w2) / (w1 / before + w2 / after);
  }

  std::vector<double> x_, y_, slope_;
};

}  // namespace tofgraph::physics
