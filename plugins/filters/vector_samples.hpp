// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Samples of any type as vectors of float, for code that is compiled once a processor (Highway's foreach_target):
/// include it after <hwy/foreach_target.h>. The guard is Highway's idiom for a header that is compiled as often as
/// that.
#if defined(TOFGRAPH_FILTERS_VECTOR_SAMPLES_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef TOFGRAPH_FILTERS_VECTOR_SAMPLES_HPP
#undef TOFGRAPH_FILTERS_VECTOR_SAMPLES_HPP
#else
#define TOFGRAPH_FILTERS_VECTOR_SAMPLES_HPP
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// A vector of samples as float.
template <class D> HWY_INLINE hn::Vec<D> LoadFloat(D d, const float* from) { return hn::LoadU(d, from); }
template <class D> HWY_INLINE hn::Vec<D> LoadFloat(D d, const std::int32_t* from) {
  return hn::ConvertTo(d, hn::LoadU(hn::RebindToSigned<D>(), from));
}
template <class D, class T>  // 16 bits
HWY_INLINE hn::Vec<D> LoadFloat(D d, const T* from) {
  return hn::ConvertTo(d, hn::PromoteTo(hn::RebindToSigned<D>(), hn::LoadU(hn::Rebind<T, D>(), from)));
}

/// The sum and the greatest of the taps that were seen. Integers as long as they can be: exact, and half as many
/// conversions.
template <class D> struct TapSums {
  hn::Vec<hn::RebindToSigned<D>> sum;
  hn::Vec<hn::Rebind<std::uint16_t, D>> greatest;
};

/// The difference of the taps A and B, where B is an image further.
template <class D> HWY_INLINE hn::Vec<D> LoadTaps(D d, const std::uint16_t* a, std::size_t pixels, TapSums<D>& sums) {
  const hn::RebindToSigned<D> di;
  const hn::Rebind<std::uint16_t, D> du16;
  const auto from_a = hn::LoadU(du16, a), from_b = hn::LoadU(du16, a + pixels);
  sums.greatest = hn::Max(sums.greatest, hn::Max(from_a, from_b));
  const auto wide_a = hn::PromoteTo(di, from_a), wide_b = hn::PromoteTo(di, from_b);
  sums.sum = hn::Add(sums.sum, hn::Add(wide_a, wide_b));
  return hn::ConvertTo(d, hn::Sub(wide_a, wide_b));
}

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
