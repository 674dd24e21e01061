// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Common part of filters that average over a window: images with a border, a frame being processed, its tiles.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace tofgraph {

/// Image with a border wide enough that no access needs a bounds check. Rows and columns count from the first pixel of
/// the image; those of the border are negative or beyond the end.
class PaddedImage {
 public:
  /// Columns right of the border for reads and writes of whole vectors.
  static constexpr std::ptrdiff_t slack = 64;

  /// Sets the size and fills all with `value`; memory is reused from frame to frame.
  void reset(std::ptrdiff_t rows, std::ptrdiff_t columns, std::ptrdiff_t border, float value) {
    border_ = border;
    stride_ = columns + 2 * border + slack;
    values_.assign(static_cast<std::size_t>(stride_ * (rows + 2 * border)), value);
  }
  float* row(std::ptrdiff_t r) { return values_.data() + (r + border_) * stride_ + border_; }
  const float* row(std::ptrdiff_t r) const { return values_.data() + (r + border_) * stride_ + border_; }

 private:
  std::vector<float> values_;
  std::ptrdiff_t border_ = 0, stride_ = 0;
};

/// Part of the image, [first_row, last_row) x [first_column, last_column).
struct Tile {
  std::ptrdiff_t first_row, last_row, first_column, last_column;
};

/// Offsets (dy, dx) of a square window, one per pair of pixels: dy > 0, or dy = 0 and dx > 0. The offset (-dy, -dx) is
/// the same pair seen from the other pixel.
struct HalfWindow {
  std::ptrdiff_t radius;

  std::ptrdiff_t first_column(std::ptrdiff_t dy) const { return dy == 0 ? 1 : -radius; }
  std::ptrdiff_t count() const { return radius + radius * (2 * radius + 1); }
  std::ptrdiff_t index(std::ptrdiff_t dy, std::ptrdiff_t dx) const {
    return dy == 0 ? dx - 1 : radius + (dy - 1) * (2 * radius + 1) + dx + radius;
  }
};

/// Settings for the comparison of patches.
struct Patch {
  std::ptrdiff_t radius = 0;
  std::vector<float> factors;  // weights along one axis, from -radius to radius, with sum 1
  bool uniform = false;        // all weights equal: uses running sums
  bool robust = false;         // pixels across an edge from the centre have less weight
  float closeness = 0;         // (h / step regarded as an edge)^2
  float floor = 0;             // expected exponent due to noise, which is subtracted
  float guide_scale = 0;       // for a guide's squared differences divided by their variance; 0: no guide
};

/// Frame being processed by a window filter. Lengths are in units of h / sqrt(ln 2), so that a weight exp(-d^2 / h^2)
/// is 2^(-d^2).
struct WindowFrame {
  /// Replaces the length of an invalid pixel: so far from all others that its weight, at least 2^-100 in
  /// single precision, changes no bit of a mean, and so near that its square, 1e-8 with that weight, changes
  /// no sigma.
  static constexpr float far_away = 1e11F;

  std::ptrdiff_t rows, columns;
  HalfWindow window;
  const float* spatial;  // exponent of the second factor, per offset index; 0 without one

  PaddedImage scaled;                 // lengths; far_away at invalid pixels and in the border
  PaddedImage variance;               // m^2, of the lengths; empty without sigma
  PaddedImage softness;               // h / h of the pixel; empty if h is the same everywhere
  PaddedImage guide, guide_variance;  // another image used for the similarity, and its noise
  Patch patch;
  float unit;      // m; of the scaled lengths
  float* lengths;  // m, NaN where invalid: filtered in place
  float* sigma;    // m; null if there is none
  bool adaptive;
};

/// Divides an image into tiles that fit a core's second-level cache together with their weights.
inline std::vector<Tile> tiles_of(std::ptrdiff_t rows, std::ptrdiff_t columns, const HalfWindow& window) {
  constexpr std::ptrdiff_t max_rows = 128, floats_in_cache = 49152, min_columns = 64;
  const std::ptrdiff_t row_of_weights = (window.radius + 1) * std::max<std::ptrdiff_t>(window.count(), 1);
  const std::ptrdiff_t max_columns = std::max(floats_in_cache / row_of_weights, min_columns);
  const auto parts = [](std::ptrdiff_t all, std::ptrdiff_t most) { return (all + most - 1) / most; };
  const std::ptrdiff_t down = parts(rows, max_rows), across = parts(columns, max_columns);
  std::vector<Tile> tiles;
  for (std::ptrdiff_t i = 0; i < down; ++i) {
    for (std::ptrdiff_t j = 0; j < across; ++j)
      tiles.push_back({rows * i / down, rows * (i + 1) / down, columns * j / across, columns * (j + 1) / across});
  }
  return tiles;
}

/// Rows of values for each pair of pixels, for the last rows of a tile within reach of a window; the pair of a pixel
/// and the one at (dy, dx) from it is stored at the former.
class PairRows {
 public:
  void reset(const Tile& tile, const HalfWindow& window) {
    rows_ = window.radius + 1;
    begin_ = tile.first_column - 2 * window.radius;
    stride_ = tile.last_column - tile.first_column + 4 * window.radius + PaddedImage::slack;
    offsets_ = window.count();
    values_.resize(static_cast<std::size_t>(rows_ * offsets_ * stride_));
  }
  /// Row r for the offset with this index, shifted so that [column] is that of the image. r from -2 radius on.
  float* row(std::ptrdiff_t r, std::ptrdiff_t index) {
    return values_.data() + ((r + 2 * rows_) % rows_ * offsets_ + index) * stride_ - begin_;
  }
  std::ptrdiff_t stride() const { return stride_; }

 private:
  std::vector<float> values_;
  std::ptrdiff_t rows_ = 0, begin_ = 0, stride_ = 0, offsets_ = 0;
};

}  // namespace tofgraph
