// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Differences of pairs of pixels as exponents, for files that are compiled once per processor (Highway's
/// foreach_target).
#if defined(TOFGRAPH_FILTERS_COMPARISON_VECTOR_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef TOFGRAPH_FILTERS_COMPARISON_VECTOR_HPP
#undef TOFGRAPH_FILTERS_COMPARISON_VECTOR_HPP
#else
#define TOFGRAPH_FILTERS_COMPARISON_VECTOR_HPP
#endif

#include <hwy/highway.h>

#include "plugins/filters/window_images.hpp"

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Exponent of a pair of pixels and 1 if both are valid, else 0 and 0.
template <class D> struct PairDifference { hn::Vec<D> exponent, valid; };

template <class D> HWY_INLINE hn::Mask<D> BothValid(D d, hn::Vec<D> first, hn::Vec<D> second) {
  return hn::Lt(hn::Max(first, second), hn::Set(d, 0.1F * WindowFrame::far_away));
}

/// Compares the pixels of a row with those at an offset from them. Holds copies of its inputs, which no store can
/// alias.
struct Comparison {
  const float *first, *second, *guide_first, *guide_second, *variance_first, *variance_second;
  float guide_scale, most;

  /// @param clip upper limit of the exponents
  Comparison(const WindowFrame& f, std::ptrdiff_t r, std::ptrdiff_t dy, std::ptrdiff_t dx, float clip)
      : first(f.scaled.row(r)), second(f.scaled.row(r + dy) + dx), guide_scale(f.patch.guide_scale), most(clip) {
    const PaddedImage &guide = guide_scale > 0 ? f.guide : f.scaled,
                      &variance = guide_scale > 0 ? f.guide_variance : f.scaled;  // not read without a guide
    guide_first = guide.row(r);
    guide_second = guide.row(r + dy) + dx;
    variance_first = variance.row(r);
    variance_second = variance.row(r + dy) + dx;
  }

  /// Clipped exponent and validity.
  template <class D> HWY_INLINE PairDifference<D> At(D d, std::ptrdiff_t x) const {
    const auto valid = BothValid(d, hn::LoadU(d, first + x), hn::LoadU(d, second + x));
    return {hn::IfThenElseZero(valid, hn::Min(Exponent(d, x), hn::Set(d, most))),
            hn::IfThenElseZero(valid, hn::Set(d, 1.0F))};
  }

  /// 0 if one of the two is invalid, and finite if both are: for callers that check the validity themselves.
  template <class D> HWY_INLINE hn::Vec<D> ExponentIfValid(D d, std::ptrdiff_t x) const {
    const auto exponent = Exponent(d, x);
    return hn::IfThenElseZero(hn::Lt(exponent, hn::Set(d, 1e20F)), exponent);  // lengths reach 1e9, far_away is 1e11
  }

 private:
  /// The guide and the length contribute half each.
  template <class D> HWY_INLINE hn::Vec<D> Exponent(D d, std::ptrdiff_t x) const {
    const auto difference = hn::Sub(hn::LoadU(d, second + x), hn::LoadU(d, first + x));
    const auto exponent = hn::Mul(difference, difference);
    if (!(guide_scale > 0)) return exponent;
    const auto step = hn::Sub(hn::LoadU(d, guide_second + x), hn::LoadU(d, guide_first + x));
    const auto variance = hn::Add(hn::LoadU(d, variance_second + x), hn::LoadU(d, variance_first + x));
    const auto scaled = hn::Div(hn::Mul(hn::Mul(step, step), hn::Set(d, guide_scale)), variance);
    return hn::Mul(hn::Set(d, 0.5F), hn::Add(exponent, scaled));
  }
};

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
