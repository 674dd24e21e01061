// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Weights by the difference of two patches, for files that are compiled once per processor (Highway's foreach_target).
///
/// For each offset the squared differences of a row are computed once. They are summed along columns from stored rows
/// (Gaussian) or by running sums (uniform), then along the row. Uniform sums use integers, so that running sums
/// accumulate no rounding error; their time does not depend on the side, that of Gaussian sums is linear in it.
#if defined(TOFGRAPH_FILTERS_PATCH_VECTOR_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef TOFGRAPH_FILTERS_PATCH_VECTOR_HPP
#undef TOFGRAPH_FILTERS_PATCH_VECTOR_HPP
#else
#define TOFGRAPH_FILTERS_PATCH_VECTOR_HPP
#endif

#include <hwy/highway.h>

#include <cmath>

#include "plugins/filters/closeness_vector.hpp"
#include "plugins/filters/comparison_vector.hpp"
#include "plugins/filters/window_vector.hpp"

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

/// Weights of the pairs of one row for every offset; exponents if h is adaptive.
template <bool Adaptive> class PatchWeights {
 public:
  static constexpr bool makes_pairs = false;
  static constexpr Spread spread = Spread::patches;

  PatchWeights(const WindowFrame& f, const Tile& tile)
      : begin_(tile.first_column - f.window.radius),
        end_(tile.last_column + f.window.radius),
        radius_(f.patch.radius),
        side_(2 * radius_ + 1),
        stride_(end_ - begin_ + 2 * radius_ + PaddedImage::slack),
        shares_(3 + 2 * f.window.radius + 1),
        complete_(Complete(f, tile)),
        closeness_(f, tile),
        memory_(Memory()) {
    const auto floats = static_cast<std::size_t>(stride_ * (shares_ + 2 * side_ * f.window.count()));
    if (memory_.size() < floats) memory_.resize(floats);
    for (std::ptrdiff_t dx = -f.window.radius; complete_ && dx <= f.window.radius; ++dx) {
      float* share = Share(f, dx);
      for (std::ptrdiff_t x = begin_; x < end_; ++x) share[x] = 1 / ShareInside(f, x, dx, f.columns);
    }
  }

  template <class D> void MakeRow(D d, const WindowFrame& f, const Tile& tile, std::ptrdiff_t r, PairRows& pairs) {
    const bool first = r == tile.first_row - f.window.radius;
    for (std::ptrdiff_t k = 0; k < side_; ++k) slots_[k] = (r - radius_ + k + f.rows * side_) % side_;
    if (f.patch.robust) closeness_.MakeRows(d, f, r, first);
    for (std::ptrdiff_t dy = 0; dy <= f.window.radius; ++dy) {
      const float share = 1 / ShareInside(f, r, dy, f.rows);
      for (std::ptrdiff_t dx = f.window.first_column(dy); dx <= f.window.radius; ++dx) {
        const Offset offset{dy, dx, f.window.index(dy, dx), share};
        float* to = pairs.row(r, offset.index);
        if (f.patch.robust)
          radius_ == 1 ? RobustRow<1>(d, f, r, offset, first, to) : RobustRow<0>(d, f, r, offset, first, to);
        else if (f.patch.uniform)
          complete_ ? UniformRow<true>(d, f, r, offset, first, to) : UniformRow<false>(d, f, r, offset, first, to);
        else if (radius_ == 1)
          complete_ ? GaussianRow<1, true>(d, f, r, offset, first, to)
                    : GaussianRow<1, false>(d, f, r, offset, first, to);
        else
          complete_ ? GaussianRow<0, true>(d, f, r, offset, first, to)
                    : GaussianRow<0, false>(d, f, r, offset, first, to);
      }
    }
  }

  template <bool SameRow, class D, class V>
  static HWY_INLINE V Below(D d, V, V softness, const float*, const float* pair) {
    const V kept = hn::LoadU(d, pair);
    if constexpr (!Adaptive) return kept;
    return PowerOfHalf(d, hn::Mul(kept, hn::Mul(softness, softness)));
  }
  template <bool SameRow, class D, class V>
  static HWY_INLINE V Above(D d, V difference, V softness, const float* spatial, const float* pair) {
    return Below<SameRow>(d, difference, softness, spatial, pair);
  }
  /// Variance of the means of a vector of pixels, m^2. @param inverse 1 / the sum of the weights
  template <Spread Kind, class D, class V> static HWY_INLINE V Variance(D d, const WindowFrame& f, std::ptrdiff_t r,
                                                                        std::ptrdiff_t x,
                                                                        const WindowSums<Kind, D>& sums, V inverse) {
    return MeanVariance(d, f, sums, inverse, ValidShare(d, f, r, x));
  }

 private:
  struct Offset {
    std::ptrdiff_t dy, dx, index;
    float share;  // 1 / the weight of those rows of a patch that are inside the image for both pixels
  };
  static constexpr std::ptrdiff_t max_side = 21;

  static std::vector<float>& Memory() {
    thread_local std::vector<float> memory;
    return memory;
  }
  /// Row of memory, shifted so that [x] is the image's column.
  float* Line(std::ptrdiff_t i) { return memory_.data() + i * stride_ - begin_ + radius_; }
  float* Kept(const Offset& offset, std::ptrdiff_t i) { return Line(shares_ + 2 * (offset.index * side_ + i)); }
  float* Share(const WindowFrame& f, std::ptrdiff_t dx) { return Line(3 + dx + f.window.radius); }

  /// Returns whether all pixels in reach of the tile's patches inside the image are valid: then the weight of the valid
  /// part of a patch is the product of one factor for rows and one for columns.
  static bool Complete(const WindowFrame& f, const Tile& tile) {
    const std::ptrdiff_t reach = f.window.radius + f.patch.radius;
    float farthest = 0;
    for (std::ptrdiff_t r = std::max<std::ptrdiff_t>(tile.first_row - reach, 0);
         r < std::min(tile.last_row + reach, f.rows); ++r) {
      const float* row = f.scaled.row(r);
      for (std::ptrdiff_t x = std::max<std::ptrdiff_t>(tile.first_column - reach, 0);
           x < std::min(tile.last_column + reach, f.columns); ++x)
        farthest = std::max(farthest, row[x]);
    }
    return farthest < WindowFrame::far_away;
  }
  /// Weight along one axis of a patch's pixels that are inside the image both for the pixel at i and for the one
  /// `step` further; 1 if there are none.
  static float ShareInside(const WindowFrame& f, std::ptrdiff_t i, std::ptrdiff_t step, std::ptrdiff_t size) {
    float share = 0;
    for (std::ptrdiff_t k = -f.patch.radius; k <= f.patch.radius; ++k) {
      const std::ptrdiff_t first = i + k, second = first + step;
      const bool inside = std::min(first, second) >= 0 && std::max(first, second) < size;
      share += inside ? f.patch.factors[static_cast<std::size_t>(k + f.patch.radius)] : 0;
    }
    return share > 0 ? share : 1;
  }

  /// Weight of the valid pixels of the patches around a vector of pixels.
  template <class D>
  static HWY_INLINE hn::Vec<D> ValidShare(D d, const WindowFrame& f, std::ptrdiff_t r, std::ptrdiff_t x) {
    const float* factors = f.patch.factors.data() + f.patch.radius;
    const auto far = hn::Set(d, 0.1F * WindowFrame::far_away);
    auto share = hn::Zero(d);
    for (std::ptrdiff_t y = -f.patch.radius; y <= f.patch.radius; ++y) {
      auto row = hn::Zero(d);
      for (std::ptrdiff_t k = -f.patch.radius; k <= f.patch.radius; ++k) {
        const auto valid = hn::Lt(hn::LoadU(d, f.scaled.row(r + y) + x + k), far);
        row = hn::Add(row, hn::IfThenElseZero(valid, hn::Set(d, factors[k])));
      }
      share = hn::MulAdd(hn::Set(d, factors[y]), row, share);
    }
    return share;
  }

  /// Converts the mean of the patches' exponents to the stored value of a pair.
  struct Finish {
    const float *first, *second;
    float floor;
    float* to;

    Finish(const WindowFrame& f, std::ptrdiff_t r, const Offset& offset, float* pair)
        : first(f.scaled.row(r)), second(f.scaled.row(r + offset.dy) + offset.dx), floor(f.patch.floor), to(pair) {}
    template <class D> HWY_INLINE void At(D d, std::ptrdiff_t x, hn::Vec<D> mean) const {
      const auto valid = BothValid(d, hn::LoadU(d, first + x), hn::LoadU(d, second + x));
      const auto above = hn::Max(hn::Sub(mean, hn::Set(d, floor)), hn::Zero(d));
      const auto exponent = hn::IfThenElse(valid, above, hn::Set(d, 1e15F));
      hn::StoreU(Adaptive ? exponent : PowerOfHalf(d, exponent), d, to + x);
    }
  };

  /// Compares the pixels of the rows in reach of patches around row r; all but the last have been stored before.
  template <bool Complete, class D>
  HWY_INLINE void KeepRows(D d, const WindowFrame& f, std::ptrdiff_t r, const Offset& offset, bool first) {
    constexpr float most = 1e20F;
    for (std::ptrdiff_t k = first ? 0 : side_ - 1; k < side_; ++k) {
      float *exponents = Kept(offset, slots_[k]), *valid = exponents + stride_;
      const Comparison comparison(f, r + k - radius_, offset.dy, offset.dx, most);
      const std::ptrdiff_t end = end_ + radius_, lanes = static_cast<std::ptrdiff_t>(hn::Lanes(d));
      for (std::ptrdiff_t x = begin_ - radius_; x < end; x += lanes) {
        if constexpr (Complete) {
          hn::StoreU(comparison.ExponentIfValid(d, x), d, exponents + x);
        } else {
          const auto pair = comparison.At(d, x);
          hn::StoreU(pair.exponent, d, exponents + x);
          hn::StoreU(pair.valid, d, valid + x);
        }
      }
    }
  }

  /// @param Radius of the patch if known at compile time, else 0
  template <int Radius, bool Complete, class D> HWY_INLINE void GaussianRow(D d, const WindowFrame& f, std::ptrdiff_t r,
                                                                            const Offset& offset, bool first,
                                                                            float* to) {
    const std::ptrdiff_t radius = Radius != 0 ? Radius : radius_, side = 2 * radius + 1, stride = stride_;
    const std::ptrdiff_t begin = begin_, end = end_, lanes = static_cast<std::ptrdiff_t>(hn::Lanes(d));
    float factor[max_side], *lines[max_side];
    std::copy_n(f.patch.factors.data(), side, factor);
    for (std::ptrdiff_t k = 0; k < side; ++k) lines[k] = Kept(offset, slots_[k]);
    KeepRows<Complete>(d, f, r, offset, first);
    float *column = Line(0), *weights = Line(1);
    for (std::ptrdiff_t x = begin - radius; x < end + radius; x += lanes) {
      auto sum = hn::Zero(d), all = hn::Zero(d);
      for (std::ptrdiff_t k = 0; k < side; ++k) {
        sum = hn::MulAdd(hn::Set(d, factor[k]), hn::LoadU(d, lines[k] + x), sum);
        if (!Complete) all = hn::MulAdd(hn::Set(d, factor[k]), hn::LoadU(d, lines[k] + stride + x), all);
      }
      hn::StoreU(sum, d, column + x);
      if (!Complete) hn::StoreU(all, d, weights + x);
    }
    const float* share = Share(f, offset.dx);
    const auto rows = hn::Set(d, offset.share);
    const Finish finish(f, r, offset, to);
    for (std::ptrdiff_t x = begin; x < end; x += lanes) {
      auto sum = hn::Zero(d), all = hn::Zero(d);
      for (std::ptrdiff_t k = 0; k < side; ++k) {
        sum = hn::MulAdd(hn::Set(d, factor[k]), hn::LoadU(d, column + x + k - radius), sum);
        if (!Complete) all = hn::MulAdd(hn::Set(d, factor[k]), hn::LoadU(d, weights + x + k - radius), all);
      }
      const auto mean = Complete ? hn::Mul(sum, hn::Mul(rows, hn::LoadU(d, share + x))) : hn::Div(sum, all);
      finish.At(d, x, mean);
    }
  }

  /// Adds a row to running sums along columns, or subtracts it.
  template <int Sign, bool Complete, class D> HWY_INLINE void AddToColumns(D d, const WindowFrame& f,
                                                                           std::ptrdiff_t row, const Offset& offset,
                                                                           float most, float scale) {
    const hn::RebindToSigned<D> di;
    auto* sums = reinterpret_cast<std::int32_t*>(Kept(offset, 0));
    auto* counts = sums + stride_;
    const Comparison comparison(f, row, offset.dy, offset.dx, most);
    const std::ptrdiff_t end = end_ + radius_, lanes = static_cast<std::ptrdiff_t>(hn::Lanes(d));
    for (std::ptrdiff_t x = begin_ - radius_; x < end; x += lanes) {
      const auto pair = comparison.At(d, x);
      const auto exponent = hn::NearestInt(hn::Mul(pair.exponent, hn::Set(d, scale)));
      const auto sum = hn::LoadU(di, sums + x);
      hn::StoreU(Sign > 0 ? hn::Add(sum, exponent) : hn::Sub(sum, exponent), di, sums + x);
      if (Complete) continue;
      const auto valid = hn::ConvertTo(di, pair.valid), count = hn::LoadU(di, counts + x);
      hn::StoreU(Sign > 0 ? hn::Add(count, valid) : hn::Sub(count, valid), di, counts + x);
    }
  }

  /// Sums of `side` neighbours along a row, to[x] from those around x, by doubling: one step per bit of the side.
  template <class D> HWY_INLINE void SumAlongRow(D d, const std::int32_t* from, std::int32_t* power, std::int32_t* to) {
    const hn::RebindToSigned<D> di;
    const std::ptrdiff_t begin = begin_ - radius_, end = end_ + radius_,
                         lanes = static_cast<std::ptrdiff_t>(hn::Lanes(d));
    std::copy(from + begin, from + end + lanes, power + begin);
    std::copy(from + begin, from + end_ - radius_ + lanes, to + begin_);  // a side is odd: its lowest bit is set
    std::ptrdiff_t shift = 1 - radius_;
    for (std::ptrdiff_t size = 1; 2 * size <= side_; size *= 2) {
      const bool takes = (side_ & (2 * size)) != 0;
      for (std::ptrdiff_t x = begin; x < end; x += lanes)
        hn::StoreU(hn::Add(hn::LoadU(di, power + x), hn::LoadU(di, power + x + size)), di, power + x);
      if (!takes) continue;
      for (std::ptrdiff_t x = begin_; x < end_; x += lanes)
        hn::StoreU(hn::Add(hn::LoadU(di, to + x), hn::LoadU(di, power + x + shift)), di, to + x);
      shift += 2 * size;
    }
  }

  template <bool Complete, class D>
  HWY_INLINE void UniformRow(D d, const WindowFrame& f, std::ptrdiff_t r, const Offset& offset, bool first, float* to) {
    // A single pair of this size gives a mean of 30, a weight of 1e-9; the sum over the patch fits in 31 bits.
    const auto pixels = static_cast<float>(side_ * side_);
    const float most = 30 * pixels, scale = std::exp2(std::floor(std::log2(2147483648.0F / (most * pixels * 1.01F))));
    auto* sums = reinterpret_cast<std::int32_t*>(Kept(offset, 0));
    if (first) {
      std::fill_n(Kept(offset, 0) + begin_ - radius_, 2 * stride_, 0.0F);
      for (std::ptrdiff_t row = r - radius_; row <= r + radius_; ++row)
        AddToColumns<1, Complete>(d, f, row, offset, most, scale);
    } else {
      AddToColumns<1, Complete>(d, f, r + radius_, offset, most, scale);
      AddToColumns<-1, Complete>(d, f, r - radius_ - 1, offset, most, scale);
    }
    auto *power = reinterpret_cast<std::int32_t*>(Line(0)), *sum = reinterpret_cast<std::int32_t*>(Line(1)),
         *count = reinterpret_cast<std::int32_t*>(Line(2));
    SumAlongRow(d, sums, power, sum);
    if (!Complete) SumAlongRow(d, sums + stride_, power, count);
    const float* share = Share(f, offset.dx);
    const auto rows = hn::Set(d, offset.share / pixels);
    const Finish finish(f, r, offset, to);
    const hn::RebindToSigned<D> di;
    for (std::ptrdiff_t x = begin_; x < end_; x += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
      const auto total = hn::Mul(hn::ConvertTo(d, hn::LoadU(di, sum + x)), hn::Set(d, 1 / scale));
      const auto mean = Complete ? hn::Mul(total, hn::Mul(rows, hn::LoadU(d, share + x)))
                                 : hn::Div(total, hn::ConvertTo(d, hn::LoadU(di, count + x)));
      finish.At(d, x, mean);
    }
  }

  /// Weights each pixel of a patch less the more its length differs from that of the patch's centre. Not separable: the
  /// time grows with the square of the side.
  template <int Radius, class D>
  HWY_INLINE void RobustRow(D d, const WindowFrame& f, std::ptrdiff_t r, const Offset& offset, bool first, float* to) {
    const std::ptrdiff_t radius = Radius != 0 ? Radius : radius_, side = 2 * radius + 1;
    KeepRows<true>(d, f, r, offset, first);  // invalid pixels have closeness 0
    const Finish finish(f, r, offset, to);
    for (std::ptrdiff_t x = begin_; x < end_; x += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
      auto sum = hn::Zero(d), all = hn::Zero(d);
      for (std::ptrdiff_t y = 0; y < side; ++y) {
        const float* exponents = Kept(offset, slots_[y]) + x - radius;
        const float *one = closeness_.Line(r, y, 0) + x, *other = closeness_.Line(r + offset.dy, y, 0) + x + offset.dx;
        for (std::ptrdiff_t k = 0; k < side; ++k) {
          const auto weight = hn::Mul(hn::LoadU(d, one), hn::LoadU(d, other));
          sum = hn::MulAdd(weight, hn::LoadU(d, exponents + k), sum);
          all = hn::Add(all, weight);
          one += closeness_.stride();
          other += closeness_.stride();
        }
      }
      finish.At(d, x, hn::Div(sum, all));
    }
  }

  std::ptrdiff_t begin_, end_, radius_, side_, stride_, shares_;
  std::ptrdiff_t slots_[max_side] = {};  // slots with the rows of the patches around the present row
  bool complete_;
  Closeness closeness_;
  std::vector<float>& memory_;
};

/// Weights of robust patches in frames with known noise: differences explained by noise have the constant weight 1.
template <bool Adaptive> class FlooredPatchWeights : public PatchWeights<Adaptive> {
 public:
  static constexpr Spread spread = Spread::floored;
  using PatchWeights<Adaptive>::PatchWeights;
};

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
