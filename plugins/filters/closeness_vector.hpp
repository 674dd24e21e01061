// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Closeness of a patch's pixels to its centre, for files that are compiled once per processor (Highway's
/// foreach_target).
#if defined(TOFGRAPH_FILTERS_CLOSENESS_VECTOR_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef TOFGRAPH_FILTERS_CLOSENESS_VECTOR_HPP
#undef TOFGRAPH_FILTERS_CLOSENESS_VECTOR_HPP
#else
#define TOFGRAPH_FILTERS_CLOSENESS_VECTOR_HPP
#endif

#include <hwy/highway.h>

#include <cmath>

#include "plugins/filters/window_vector.hpp"

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

/// Factorised weights of robust patches. The weight of a pair of positions in two patches, g exp(-(s^2 + s'^2) / (4
/// h)^2), is the product of one factor per patch, sqrt(g) exp(-s^2 / (4 h)^2), computed once for all comparisons of
/// that patch. 0 for invalid pixels. Kept for the rows of patches that a window reaches below the present one.
class Closeness {
 public:
  Closeness(const WindowFrame& f, const Tile& tile)
      : begin_(tile.first_column - 2 * f.window.radius),
        end_(tile.last_column + 2 * f.window.radius),
        side_(2 * f.patch.radius + 1),
        rows_(f.window.radius + 1),
        stride_(end_ - begin_ + PaddedImage::slack),
        memory_(Memory()) {
    const auto floats = static_cast<std::size_t>(rows_ * side_ * side_ * stride_);
    if (f.patch.robust && memory_.size() < floats) memory_.resize(floats);
  }

  /// Computes the factors of the patches around rows r to r + window radius. @param first no row exists yet
  template <class D> void MakeRows(D d, const WindowFrame& f, std::ptrdiff_t r, bool first) {
    for (std::ptrdiff_t row = first ? r : r + rows_ - 1; row < r + rows_; ++row) {
      for (std::ptrdiff_t y = 0; y < side_; ++y)
        for (std::ptrdiff_t k = 0; k < side_; ++k) MakeLine(d, f, row, y, k);
    }
  }

  /// Factors at position (y, k) of the patches around a row's pixels, indexed by the image's column [x].
  const float* Line(std::ptrdiff_t row, std::ptrdiff_t y, std::ptrdiff_t k) const {
    return memory_.data() + At(row, y, k);
  }
  /// Offset from the line of one position to that of the next, (y, k + 1).
  std::ptrdiff_t stride() const { return stride_; }

 private:
  static std::vector<float>& Memory() {
    thread_local std::vector<float> memory;
    return memory;
  }
  std::ptrdiff_t At(std::ptrdiff_t row, std::ptrdiff_t y, std::ptrdiff_t k) const {
    return (((row + 2 * rows_) % rows_ * side_ + y) * side_ + k) * stride_ - begin_;
  }

  template <class D>
  HWY_INLINE void MakeLine(D d, const WindowFrame& f, std::ptrdiff_t row, std::ptrdiff_t y, std::ptrdiff_t k) {
    const std::ptrdiff_t radius = f.patch.radius;
    const float *middle = f.scaled.row(row), *pixel = f.scaled.row(row + y - radius) + k - radius;
    const float* factors = f.patch.factors.data();
    const auto share = hn::Set(d, std::sqrt(factors[y] * factors[k])), closeness = hn::Set(d, f.patch.closeness);
    const auto far = hn::Set(d, 0.1F * WindowFrame::far_away);
    float* to = memory_.data() + At(row, y, k);
    for (std::ptrdiff_t x = begin_; x < end_; x += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
      const auto length = hn::LoadU(d, pixel + x), step = hn::Sub(length, hn::LoadU(d, middle + x));
      const auto close = PowerOfHalf(d, hn::Mul(hn::Mul(step, step), closeness));
      hn::StoreU(hn::IfThenElseZero(hn::Lt(length, far), hn::Mul(share, close)), d, to + x);
    }
  }

  std::ptrdiff_t begin_, end_, side_, rows_, stride_;
  std::vector<float>& memory_;
};

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
