// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Resampling of images to an ideal pinhole: source of each pixel, and interpolation of each kind of channel.
#pragma once

#include <tofgraph/physics/lens.hpp>
#include <tofgraph/stage.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace tofgraph {

/// Map from each pixel (u, v) of a pinhole with the camera's focal length and principal point to the
/// position of the same ray in the camera's image, as the four pixels around it with their bilinear
/// weights. Lengths are NaN if any of the four is NaN, other images ignore NaN pixels, flags are
/// combined.
class Rectification {
 public:
  Rectification() = default;
  explicit Rectification(const tofgraph_camera& camera)
      : rows_(camera.height), columns_(camera.width), sources_(std::size_t{camera.width} * camera.height) {
    const physics::Lens lens(camera);
    for (std::size_t v = 0; v < rows_; ++v) {
      for (std::size_t u = 0; u < columns_; ++u) sources_[v * columns_ + u] = source_of(camera, lens, u, v);
    }
  }

  std::size_t rows() const { return rows_; }
  std::size_t columns() const { return columns_; }
  std::size_t pixels() const { return sources_.size(); }
  /// Number of pixels that have a source.
  std::size_t inside() const {
    return static_cast<std::size_t>(std::ranges::count_if(sources_, [](const Source& s) { return s.bits == 0; }));
  }

  void lengths(const float* in, float* out) const {
    each(out, nan, [in](const Source& s) {
      const float* p = in + s.first;
      return s.weight[0] * p[0] + s.weight[1] * p[s.right] + s.weight[2] * p[s.below] +
             s.weight[3] * p[s.below + s.right];
    });
  }

  /// Standard deviation of the weighted mean of four independent values: the root of sum of weight^2 variance.
  void deviations(const float* in, float* out) const {
    each(out, nan, [in](const Source& s) {
      const float* p = in + s.first;
      const auto part = [](float weight, float sd) { return weight * weight * sd * sd; };
      return std::sqrt(part(s.weight[0], p[0]) + part(s.weight[1], p[s.right]) + part(s.weight[2], p[s.below]) +
                       part(s.weight[3], p[s.below + s.right]));
    });
  }

  /// Resamples a channel other than a length, from those of the four pixels that are not NaN.
  void values(const float* in, float* out) const {
    each(out, nan, [in](const Source& s) {
      float sum = 0, weights = 0;
      for (std::uint32_t k = 0; k < 4; ++k) {
        const float value = in[s.pixel(k)];
        const bool number = value == value;
        sum += number ? s.weight[k] * value : 0;
        weights += number ? s.weight[k] : 0;
      }
      return weights > 0 ? sum / weights : nan;
    });
  }

  /// Counts are rounded to integers; 0 without a source, which the flags show. If one of the four is saturated, the
  /// greatest is kept, so that the result is saturated too.
  /// @param full smallest count of a saturated tap; infinity: none is
  template <class T> void counts(const T* in, T* out, double full) const {
    each(out, T{0}, [in, full](const Source& s) {
      double sum = 0.5;
      T greatest = in[s.first];
      for (std::uint32_t k = 0; k < 4; ++k) {
        const T value = in[s.pixel(k)];
        greatest = std::max(greatest, value);
        sum += static_cast<double>(s.weight[k]) * value;
      }
      return static_cast<double>(greatest) >= full ? greatest : static_cast<T>(std::floor(sum));
    });
  }

  /// Combines the flags of all four pixels; without a source, the reason.
  void flags(const std::uint16_t* in, std::uint16_t* out) const {
    for (std::size_t i = 0; i < sources_.size(); ++i) {
      const Source& s = sources_[i];
      const std::uint16_t* p = in + s.first;
      const int joined = s.bits != 0 ? 0 : p[0] | p[s.right] | p[s.below] | p[s.below + s.right];
      out[i] = static_cast<std::uint16_t>(joined | static_cast<int>(s.bits));
    }
  }

  /// Flags a pixel as invalid if its length has become NaN.
  static void mark(const float* length, std::uint16_t* out, std::size_t pixels) {
    for (std::size_t i = 0; i < pixels; ++i)
      out[i] = static_cast<std::uint16_t>(out[i] | (length[i] == length[i] ? 0 : flag::invalid));
  }

 private:
  static constexpr float nan = std::numeric_limits<float>::quiet_NaN();

  /// Four pixels around a position. A neighbour with weight 0 is replaced by the pixel itself and has no effect.
  struct Source {
    std::uint32_t first = 0, right = 0, below = 0;  // pixel; offsets of its neighbours
    std::uint16_t bits = 0;                         // flags of a pixel without a source
    float weight[4] = {};
    std::size_t pixel(std::uint32_t k) const { return first + (k & 1U) * right + (k >> 1U) * below; }
  };

  template <class T, class Mix> void each(T* out, T nothing, Mix&& mix) const {
    for (std::size_t i = 0; i < sources_.size(); ++i) out[i] = sources_[i].bits == 0 ? mix(sources_[i]) : nothing;
  }

  Source source_of(const tofgraph_camera& camera, const physics::Lens& lens, std::size_t u, std::size_t v) const {
    const double(&f)[2] = camera.focal_px;
    const double(&c)[2] = camera.principal_point;
    const physics::ImagePoint ideal{(static_cast<double>(u) - c[0]) / f[0], (static_cast<double>(v) - c[1]) / f[1]};
    Source source;
    const auto seen = physics::pixel_of(camera, lens, ideal);
    if (!seen) {
      source.bits = flag::invalid | flag::outside_lens;
      return source;
    }
    // Rounds to a millionth of a pixel, so that rounding errors give no weight to a neighbour.
    const auto snapped = [](double x) { return std::round(x * 1e6) / 1e6; };
    const double x = snapped(seen->x), y = snapped(seen->y);
    if (!(x >= 0 && y >= 0 && x <= static_cast<double>(columns_ - 1) && y <= static_cast<double>(rows_ - 1))) {
      source.bits = flag::invalid;
      return source;
    }
    const auto column = static_cast<std::size_t>(x), row = static_cast<std::size_t>(y);
    const double a = x - static_cast<double>(column), b = y - static_cast<double>(row);
    source.first = static_cast<std::uint32_t>(row * columns_ + column);
    source.right = a > 0 ? 1U : 0U;
    source.below = b > 0 ? static_cast<std::uint32_t>(columns_) : 0U;
    const double weights[] = {(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b};
    std::ranges::transform(weights, source.weight, [](double weight) { return static_cast<float>(weight); });
    return source;
  }

  std::size_t rows_ = 0, columns_ = 0;
  std::vector<Source> sources_;
};

}  // namespace tofgraph
