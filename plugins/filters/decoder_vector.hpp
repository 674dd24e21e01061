// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Functions of decoders for a vector of pixels: samples of any type as float, flags, stores. For code that is compiled
/// once per processor (Highway's foreach_target): include it after <hwy/foreach_target.h>. The guard is Highway's idiom
/// for such a header.
#if defined(TOFGRAPH_FILTERS_DECODER_VECTOR_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef TOFGRAPH_FILTERS_DECODER_VECTOR_HPP
#undef TOFGRAPH_FILTERS_DECODER_VECTOR_HPP
#else
#define TOFGRAPH_FILTERS_DECODER_VECTOR_HPP
#endif

#include <hwy/highway.h>

#include "plugins/filters/decoder.hpp"

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Loads a vector of samples as float.
template <class D> HWY_INLINE hn::Vec<D> LoadFloat(D d, const float* from) { return hn::LoadU(d, from); }
template <class D> HWY_INLINE hn::Vec<D> LoadFloat(D d, const std::int32_t* from) {
  return hn::ConvertTo(d, hn::LoadU(hn::RebindToSigned<D>(), from));
}
template <class D, class T>  // 16-bit types
HWY_INLINE hn::Vec<D> LoadFloat(D d, const T* from) {
  return hn::ConvertTo(d, hn::PromoteTo(hn::RebindToSigned<D>(), hn::LoadU(hn::Rebind<T, D>(), from)));
}

/// Sum and maximum of the taps so far. Integers as long as possible: exact, and half as many
/// conversions.
template <class D> struct TapSums {
  hn::Vec<hn::RebindToSigned<D>> sum;
  hn::Vec<hn::Rebind<std::uint16_t, D>> greatest;
};

/// Loads the difference of the taps A and B, where B is stored one image after A.
template <class D> HWY_INLINE hn::Vec<D> LoadTaps(D d, const std::uint16_t* a, std::size_t pixels, TapSums<D>& sums) {
  const hn::RebindToSigned<D> di;
  const hn::Rebind<std::uint16_t, D> du16;
  const auto from_a = hn::LoadU(du16, a), from_b = hn::LoadU(du16, a + pixels);
  sums.greatest = hn::Max(sums.greatest, hn::Max(from_a, from_b));
  const auto wide_a = hn::PromoteTo(di, from_a), wide_b = hn::PromoteTo(di, from_b);
  sums.sum = hn::Add(sums.sum, hn::Add(wide_a, wide_b));
  return hn::ConvertTo(d, hn::Sub(wide_a, wide_b));
}

/// Decoded vector of pixels.
template <class D> struct Pixels {
  hn::Vec<hn::RebindToSigned<D>> flags;
  hn::Vec<D> distance, amplitude, intensity;
  hn::Mask<D> measured;
};

template <class D> HWY_INLINE hn::Vec<hn::RebindToSigned<D>> LoadFlags(D, const std::uint16_t* from) {
  return hn::PromoteTo(hn::RebindToSigned<D>(), hn::LoadU(hn::Rebind<std::uint16_t, D>(), from));
}

template <class D>
HWY_INLINE void Raise(D, hn::Vec<hn::RebindToSigned<D>>& flags, hn::Mask<D> where, std::uint16_t flag) {
  const hn::RebindToSigned<D> di;
  flags = hn::Or(flags, hn::IfThenElseZero(hn::RebindMask(di, where), hn::Set(di, flag)));
}

/// Flags pixels by their light and stores all outputs except sigma. @returns the valid pixels
template <bool Taps, class D> HWY_INLINE hn::Mask<D> StorePixels(D d, const DecoderCounts& counts,
                                                                 const DecoderImages& images, std::size_t i,
                                                                 const TapSums<D>& sums, Pixels<D> pixels) {
  const hn::RebindToSigned<D> di;
  const hn::Rebind<std::uint16_t, D> du16;
  if constexpr (Taps) {
    const auto greatest = hn::ConvertTo(d, hn::PromoteTo(di, sums.greatest));
    Raise(d, pixels.flags, hn::Ge(greatest, hn::Set(d, counts.full_well)), flag::saturated);
  }
  Raise(d, pixels.flags, hn::Lt(pixels.amplitude, hn::Set(d, counts.min_amplitude)), flag::low_signal);
  const auto bad = hn::And(pixels.flags, hn::Set(di, counts.invalid_flags));
  const auto valid = hn::And(pixels.measured, hn::RebindMask(d, hn::Eq(bad, hn::Zero(di))));
  Raise(d, pixels.flags, hn::Not(valid), flag::invalid);
  hn::StoreU(hn::DemoteTo(du16, pixels.flags), du16, images.flags + i);
  hn::StoreU(hn::IfThenElse(valid, pixels.distance, hn::NaN(d)), d, images.distance + i);
  hn::StoreU(pixels.amplitude, d, images.amplitude + i);
  if (Taps) hn::StoreU(pixels.intensity, d, images.intensity + i);
  return valid;
}

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
