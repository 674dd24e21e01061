// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The vector code of the filters that average over a window, for files that are compiled once a processor (Highway's
/// foreach_target): include it after <hwy/foreach_target.h>.
///
/// Weights are symmetric, w(x, y) = w(y, x), so each is made once: row by row, all weights of pairs whose first pixel
/// is in the row; then the row's averages from these and from those of the rows above, which are kept.
#if defined(TOFGRAPH_FILTERS_WINDOW_VECTOR_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef TOFGRAPH_FILTERS_WINDOW_VECTOR_HPP
#undef TOFGRAPH_FILTERS_WINDOW_VECTOR_HPP
#else
#define TOFGRAPH_FILTERS_WINDOW_VECTOR_HPP
#endif

#include <hwy/highway.h>

#include "plugins/filters/window_images.hpp"

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// 2^-min(q, 100) for q >= 0, to 3e-6 of the value: q is an integer k and a rest of at most 1/2, 2^-rest the polynomial
/// of degree 4 with the least relative error, 2.6e-6, and 2^-k goes into the exponent. An average over weights that are
/// off by a part e is off by at most e times the mean distance of what is averaged from its mean, which is below 3 h
/// for weights exp(-d^2 / h^2) in any window: with h = 1 m below 0.01 mm.
template <class D, class V = hn::Vec<D>> HWY_INLINE V PowerOfHalf(D d, V q) {
  const hn::RebindToSigned<D> di;
  const V magic = hn::Set(d, 12582912.0F);  // 1.5 * 2^23: adding it rounds to an integer, kept in the lowest bits
  q = hn::Min(q, hn::Set(d, 100.0F));
  const V shifted = hn::Sub(magic, q);
  const V rest = hn::Add(q, hn::Sub(shifted, magic));
  V p = hn::Set(d, 0.0095701020146293256F);
  p = hn::MulAdd(p, rest, hn::Set(d, -0.055917860306325652F));
  p = hn::MulAdd(p, rest, hn::Set(d, 0.24024744824991691F));
  p = hn::MulAdd(p, rest, hn::Set(d, -0.69312181474298668F));
  p = hn::MulAdd(p, rest, hn::Set(d, 0.99999926144693115F));
  return hn::BitCast(d, hn::Add(hn::BitCast(di, p), hn::ShiftLeft<23>(hn::BitCast(di, shifted))));
}

/// The pairs' weights of one row, by the difference of the two pixels; squared differences when h is adaptive.
struct PixelWeights {
  explicit PixelWeights(const WindowFrame&, const Tile&) {}

  template <class D> void MakeRow(D d, const WindowFrame& f, const Tile& tile, std::ptrdiff_t r, PairRows& pairs) {
    const HalfWindow& window = f.window;
    for (std::ptrdiff_t dy = 0; dy <= window.radius; ++dy) {
      for (std::ptrdiff_t dx = window.first_column(dy); dx <= window.radius; ++dx) {
        const std::ptrdiff_t index = window.index(dy, dx);
        const float *first = f.scaled.row(r), *second = f.scaled.row(r + dy) + dx;
        float* to = pairs.row(r, index);
        const auto spatial = hn::Set(d, f.spatial[index]);
        const std::ptrdiff_t begin = tile.first_column - window.radius, end = tile.last_column + window.radius;
        for (std::ptrdiff_t x = begin; x < end; x += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
          const auto difference = hn::Sub(hn::LoadU(d, second + x), hn::LoadU(d, first + x));
          if (f.adaptive)
            hn::StoreU(hn::Mul(difference, difference), d, to + x);
          else
            hn::StoreU(PowerOfHalf(d, hn::MulAdd(difference, difference, spatial)), d, to + x);
        }
      }
    }
  }
};

/// Sums over a window about a vector of pixels.
template <class D> struct WindowSums { hn::Vec<D> weights, differences, variance; };

/// Adds the pixel at an offset; lengths as differences, so that what is constant stays what it is to the last bit.
template <bool Sigma, class D> HWY_INLINE void AddPixel(D d, hn::Vec<D> weight, hn::Vec<D> centre, const float* length,
                                                        const float* variance, WindowSums<D>& sums) {
  sums.weights = hn::Add(sums.weights, weight);
  sums.differences = hn::MulAdd(weight, hn::Sub(hn::LoadU(d, length), centre), sums.differences);
  if constexpr (Sigma) sums.variance = hn::MulAdd(hn::Mul(weight, weight), hn::LoadU(d, variance), sums.variance);
}

/// Averages of one row of a tile, from the pairs of this row and of those above.
template <bool Sigma, bool Adaptive, class D> HWY_INLINE void AverageRow(D d, WindowFrame& f, const Tile& tile,
                                                                         std::ptrdiff_t r, PairRows& pairs,
                                                                         float* shift, float* deviation) {
  using V = hn::Vec<D>;
  const HalfWindow& window = f.window;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0F);
  for (std::ptrdiff_t x = tile.first_column; x < tile.last_column; x += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
    const V centre = hn::LoadU(d, f.scaled.row(r) + x);
    const V softness = Adaptive ? hn::LoadU(d, f.softness.row(r) + x) : one;
    const auto weight = [&](const float* pair, std::ptrdiff_t index) {
      const V kept = hn::LoadU(d, pair);
      if constexpr (!Adaptive) return kept;
      return PowerOfHalf(d, hn::MulAdd(kept, softness, hn::Set(d, f.spatial[index])));
    };
    // Two sums side by side, so that an addition need not wait for the one before. The pixel itself has weight 1.
    WindowSums<D> below{one, zero, Sigma ? hn::LoadU(d, f.variance.row(r) + x) : zero}, above{zero, zero, zero};
    for (std::ptrdiff_t dy = 0; dy <= window.radius; ++dy) {
      std::ptrdiff_t dx = window.first_column(dy), index = window.index(dy, dx);
      const float *pair_below = pairs.row(r, index) + x, *pair_above = pairs.row(r - dy, index) + x - dx;
      const float *length_below = f.scaled.row(r + dy) + x, *length_above = f.scaled.row(r - dy) + x;
      const PaddedImage& variance = Sigma ? f.variance : f.scaled;  // without sigma: not read
      const float *variance_below = variance.row(r + dy) + x, *variance_above = variance.row(r - dy) + x;
      for (; dx <= window.radius; ++dx, ++index) {
        AddPixel<Sigma>(d, weight(pair_below, index), centre, length_below + dx, variance_below + dx, below);
        AddPixel<Sigma>(d, weight(pair_above, index), centre, length_above - dx, variance_above - dx, above);
        pair_below += pairs.stride();
        pair_above += pairs.stride() - 1;
      }
    }
    const V inverse = hn::Div(one, hn::Add(below.weights, above.weights));
    const V difference = hn::Mul(hn::Add(below.differences, above.differences), inverse);
    hn::StoreU(hn::Mul(difference, hn::Set(d, f.unit)), d, shift + x - tile.first_column);
    if constexpr (Sigma) {
      const V sigma = hn::Mul(hn::Sqrt(hn::Add(below.variance, above.variance)), inverse);
      hn::StoreU(sigma, d, deviation + x - tile.first_column);
    }
  }
}

/// Filters a tile: Weights makes the pairs of a row.
template <class Weights, bool Sigma, bool Adaptive> void FilterTileAs(WindowFrame& f, const Tile& tile) {
  const hn::ScalableTag<float> d;
  thread_local PairRows pairs;
  thread_local std::vector<float> shift, deviation;
  const auto width = static_cast<std::size_t>(tile.last_column - tile.first_column);
  shift.resize(width + PaddedImage::slack);
  deviation.resize(width + PaddedImage::slack);
  pairs.reset(tile, f.window);
  Weights weights(f, tile);
  for (std::ptrdiff_t r = tile.first_row - f.window.radius; r < tile.last_row; ++r) {
    weights.MakeRow(d, f, tile, r, pairs);
    if (r < tile.first_row) continue;
    AverageRow<Sigma, Adaptive>(d, f, tile, r, pairs, shift.data(), deviation.data());
    float* lengths = f.lengths + r * f.columns + tile.first_column;
    for (std::size_t i = 0; i < width; ++i) lengths[i] += shift[i];
    if constexpr (!Sigma) continue;
    float* sigma = f.sigma + r * f.columns + tile.first_column;
    for (std::size_t i = 0; i < width; ++i) sigma[i] = lengths[i] == lengths[i] ? deviation[i] : lengths[i];
  }
}

template <class Weights> void FilterTile(WindowFrame& f, const Tile& tile) {
  if (f.sigma != nullptr)
    return f.adaptive ? FilterTileAs<Weights, true, true>(f, tile) : FilterTileAs<Weights, true, false>(f, tile);
  FilterTileAs<Weights, false, false>(f, tile);  // adaptive needs sigma
}

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
