// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The vector code of the filters that average over a window, for files that are compiled once per processor (Highway's
/// foreach_target): include it after <hwy/foreach_target.h>.
///
/// Weights are symmetric, w(x, y) = w(y, x), so each is computed once: row by row, all weights of pairs whose first
/// pixel is in the row; then the row's averages from these and from the stored ones of the rows above.
#if defined(TOFGRAPH_FILTERS_WINDOW_VECTOR_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef TOFGRAPH_FILTERS_WINDOW_VECTOR_HPP
#undef TOFGRAPH_FILTERS_WINDOW_VECTOR_HPP
#else
#define TOFGRAPH_FILTERS_WINDOW_VECTOR_HPP
#endif

#include <hwy/highway.h>

#include "plugins/filters/spread_vector.hpp"
#include "plugins/filters/window_images.hpp"

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// 2^-min(q, 100) for q >= 0, with a relative error of 3e-6: q is split into an integer k and a remainder of at most
/// 1/2; 2^-remainder is the polynomial of degree 4 with the minimum relative error, 2.6e-6, and 2^-k is put into the
/// exponent. If the weights have a relative error e, an average is wrong by at most e times the mean distance of the
/// values from their mean, which is below 3 h for weights exp(-d^2 / h^2) in any window: below 0.01 mm for h = 1 m.
template <class D, class V = hn::Vec<D>> HWY_INLINE V PowerOfHalf(D d, V q) {
  const hn::RebindToSigned<D> di;
  const V magic = hn::Set(d, 12582912.0F);  // 1.5 * 2^23: adding it rounds to an integer, which is in the lowest bits
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

/// Calls body(x) for every vector of [begin, end), the last of which may reach beyond the end; two vectors at a time,
/// so that their arithmetic overlaps: body's template argument is their number.
template <class D, class Body> HWY_INLINE void ForVectors(D d, std::ptrdiff_t begin, std::ptrdiff_t end, Body&& body) {
  const auto lanes = static_cast<std::ptrdiff_t>(hn::Lanes(d));
  std::ptrdiff_t x = begin;
  for (; x + lanes < end; x += 2 * lanes) body.template operator()<2>(x);
  if (x < end) body.template operator()<1>(x);
}

/// Weights by the difference of two pixels. The weight of a pixel and one below it (or right of it in its row) is
/// computed when the first is averaged, and stored for the second unless both are in one row: loading across a recent
/// store costs more than computing it again. Adaptive weights are not symmetric, so none is stored.
template <bool Adaptive> class PixelWeights {
 public:
  static constexpr bool makes_pairs = !Adaptive;
  static constexpr Spread spread = Spread::pixels;
  PixelWeights(const WindowFrame&, const Tile&) {}
  template <class D> void MakeRow(D, const WindowFrame&, const Tile&, std::ptrdiff_t, PairRows&) {}

  /// @param SameRow the pair's pixels are in one row
  template <bool SameRow, class D, class V>
  static HWY_INLINE V Below(D d, V difference, V softness, const float* spatial, float* pair) {
    const V weight = Make(d, difference, softness, spatial);
    if constexpr (makes_pairs && !SameRow) hn::StoreU(weight, d, pair);
    return weight;
  }
  template <bool SameRow, class D, class V>
  static HWY_INLINE V Above(D d, V difference, V softness, const float* spatial, const float* pair) {
    if constexpr (makes_pairs && !SameRow) return hn::LoadU(d, pair);
    return Make(d, difference, softness, spatial);
  }
  /// Variance of the means of a vector of pixels, m^2. @param inverse 1 / the sum of the weights
  template <class D, class V> static HWY_INLINE V Variance(D d, const WindowFrame&, std::ptrdiff_t, std::ptrdiff_t,
                                                           const WindowSums<spread, D>& sums, V inverse) {
    return MeanVariance(d, sums, inverse);
  }

 private:
  template <class D, class V> static HWY_INLINE V Make(D d, V difference, V softness, const float* spatial) {
    if constexpr (Adaptive) difference = hn::Mul(difference, softness);
    return PowerOfHalf(d, hn::MulAdd(difference, difference, hn::Set(d, *spatial)));
  }
};

/// Rows needed for the sums of a row of pixels: `below` and `above` point to the rows at distance dy, at the first
/// pixel.
struct WindowRows {
  const float *below, *above, *variance_below, *variance_above;
  float *pair_below, *pair_above;
  const float* spatial;
  std::ptrdiff_t first, last, stride;  // offsets of columns; of the pairs from one offset to the next

  WindowRows(const WindowFrame& f, PairRows& pairs, std::ptrdiff_t r, std::ptrdiff_t dy, std::ptrdiff_t x)
      : first(f.window.first_column(dy)), last(f.window.radius), stride(pairs.stride()) {
    const PaddedImage& variances = f.sigma != nullptr ? f.variance : f.scaled;  // not read without sigma
    const std::ptrdiff_t index = f.window.index(dy, first);
    below = f.scaled.row(r + dy) + x;
    above = f.scaled.row(r - dy) + x;
    variance_below = variances.row(r + dy) + x;
    variance_above = variances.row(r - dy) + x;
    pair_below = pairs.row(r, index) + x;
    pair_above = pairs.row(r - dy, index) + x - first;
    spatial = f.spatial + index;
  }
};

/// Adds the pixels of two rows to the sums of Count vectors.
template <class Weights, bool SameRow, int Count, Spread Kind, class D>
HWY_INLINE void AddRows(D d, WindowRows rows, WindowSums<Kind, D> (&sums)[Count]) {
  const auto lanes = static_cast<std::ptrdiff_t>(hn::Lanes(d));
  for (std::ptrdiff_t dx = rows.first; dx <= rows.last; ++dx) {
    for (int i = 0; i < Count; ++i) {
      const std::ptrdiff_t at = i * lanes;
      auto difference = hn::Sub(sums[i].centre, hn::LoadU(d, rows.below + at + dx));
      auto weight =
          Weights::template Below<SameRow>(d, difference, sums[i].softness, rows.spatial, rows.pair_below + at);
      sums[i].Add(d, weight, difference, rows.variance_below + at + dx);
      difference = hn::Sub(sums[i].centre, hn::LoadU(d, rows.above + at - dx));
      weight = Weights::template Above<SameRow>(d, difference, sums[i].softness, rows.spatial, rows.pair_above + at);
      sums[i].Add(d, weight, difference, rows.variance_above + at - dx);
    }
    ++rows.spatial;
    rows.pair_below += rows.stride;
    rows.pair_above += rows.stride - 1;
  }
}

/// Averages of the pixels [begin, end) of a row, from the pairs of this row and of those above; `shift` and `deviation`
/// start at the first pixel.
template <class Weights, bool Sigma, bool Adaptive, class D>
HWY_INLINE void AverageRow(D d, const WindowFrame& f, std::ptrdiff_t r, std::ptrdiff_t begin, std::ptrdiff_t end,
                           PairRows& pairs, float* shift, float* deviation) {
  using V = hn::Vec<D>;
  constexpr Spread kind = Sigma ? Weights::spread : Spread::none;
  const auto lanes = static_cast<std::ptrdiff_t>(hn::Lanes(d));
  const auto average = [&]<int Count>(std::ptrdiff_t x) HWY_ATTR {
    const V zero = hn::Zero(d), one = hn::Set(d, 1.0F);
    WindowSums<kind, D> sums[Count];
    for (int i = 0; i < Count; ++i) {
      const std::ptrdiff_t at = x + i * lanes;
      sums[i].Start(d, hn::LoadU(d, f.scaled.row(r) + at), Adaptive ? hn::LoadU(d, f.softness.row(r) + at) : one,
                    Sigma ? hn::LoadU(d, f.variance.row(r) + at) : zero);
    }
    AddRows<Weights, true>(d, WindowRows(f, pairs, r, 0, x), sums);
    for (std::ptrdiff_t dy = 1; dy <= f.window.radius; ++dy)
      AddRows<Weights, false>(d, WindowRows(f, pairs, r, dy, x), sums);
    for (int i = 0; i < Count; ++i) {
      const V inverse = hn::Div(one, sums[i].weights);
      const std::ptrdiff_t to = x - begin + i * lanes;
      hn::StoreU(hn::Mul(hn::Mul(sums[i].differences, inverse), hn::Set(d, f.unit)), d, shift + to);
      if constexpr (Sigma)
        hn::StoreU(hn::Sqrt(Weights::Variance(d, f, r, x + i * lanes, sums[i], inverse)), d, deviation + to);
    }
  };
  ForVectors(d, begin, end, average);
}

/// Filters a tile. If pairs are computed together with the averages, averages are also computed, and discarded, for
/// pixels left of, right of and above the tile whose pairs reach into it.
template <template <bool> class WeightsOf, bool Sigma, bool Adaptive>
void FilterTileAs(const WindowFrame& f, const Tile& tile) {
  using Weights = WeightsOf<Adaptive>;
  const hn::ScalableTag<float> d;
  thread_local PairRows kept_pairs;
  thread_local std::vector<float> kept_shift, kept_deviation;
  PairRows& pairs = kept_pairs;
  pairs.reset(tile, f.window);
  kept_shift.resize(static_cast<std::size_t>(pairs.stride()));
  kept_deviation.resize(static_cast<std::size_t>(pairs.stride()));
  float *shift = kept_shift.data(), *deviation = kept_deviation.data();
  const std::ptrdiff_t width = tile.last_column - tile.first_column;
  const std::ptrdiff_t margin = Weights::makes_pairs ? f.window.radius : 0;
  Weights weights(f, tile);
  for (std::ptrdiff_t r = tile.first_row - f.window.radius; r < tile.last_row; ++r) {
    weights.MakeRow(d, f, tile, r, pairs);
    if (r < tile.first_row && !Weights::makes_pairs) continue;
    AverageRow<Weights, Sigma, Adaptive>(d, f, r, tile.first_column - margin, tile.last_column + margin, pairs, shift,
                                         deviation);
    if (r < tile.first_row) continue;
    float* lengths = f.lengths + r * f.columns + tile.first_column;
    for (std::ptrdiff_t i = 0; i < width; ++i) lengths[i] += shift[i + margin];
    if constexpr (!Sigma) continue;
    float* sigma = f.sigma + r * f.columns + tile.first_column;
    for (std::ptrdiff_t i = 0; i < width; ++i) sigma[i] = lengths[i] == lengths[i] ? deviation[i + margin] : lengths[i];
  }
}

template <template <bool> class Weights> void FilterTile(const WindowFrame& f, const Tile& tile) {
  if (f.sigma != nullptr)
    return f.adaptive ? FilterTileAs<Weights, true, true>(f, tile) : FilterTileAs<Weights, true, false>(f, tile);
  FilterTileAs<Weights, false, false>(f, tile);  // adaptive needs sigma
}

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
