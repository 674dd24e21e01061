// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Arithmetic of the decoder for arbitrary exposures, on vectors of pixels; compiled for each of Highway's targets.
#if defined(TOFGRAPH_FILTERS_PHASE_VECTOR_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef TOFGRAPH_FILTERS_PHASE_VECTOR_HPP
#undef TOFGRAPH_FILTERS_PHASE_VECTOR_HPP
#else
#define TOFGRAPH_FILTERS_PHASE_VECTOR_HPP
#endif

#include <tofgraph/physics/vector_phase.hpp>

#include "plugins/filters/decoder_vector.hpp"
#include "plugins/filters/phase_settings.hpp"

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Most likely distance; physics::Unwrapping is the same in double precision.
template <class D, class V = hn::Vec<D>> struct Likeliest { V distance, cost, second; };

template <std::size_t Bands, class D, class V = hn::Vec<D>>
HWY_INLINE Likeliest<D> Unwrap(D d, const PhaseSettings& s, const V* distances, const V* weights, V inverse_sum) {
  const V never = hn::Set(d, hwy::HighestValue<float>());
  Likeliest<D> result{hn::NaN(d), never, never};
  for (int wrap = s.first_wrap; wrap <= s.last_wrap; ++wrap) {
    const V reference =
        hn::MulAdd(hn::Set(d, static_cast<float>(wrap)), hn::Set(d, s.range[Bands - 1]), distances[Bands - 1]);
    V first = hn::Zero(d), square = hn::Zero(d);
    for (std::size_t b = 0; b + 1 < Bands; ++b) {
      const V away = hn::Sub(distances[b], reference);
      const V wraps = hn::Round(hn::Mul(away, hn::Set(d, s.inverse_range[b])));
      const V rest = hn::NegMulAdd(wraps, hn::Set(d, s.range[b]), away);
      const V weighted = hn::Mul(weights[b], rest);
      first = hn::Add(first, weighted);
      square = hn::MulAdd(weighted, rest, square);
    }
    const V shift = hn::Mul(first, inverse_sum);
    const V cost = hn::NegMulAdd(first, shift, square);
    result.second = hn::Min(result.second, hn::Max(result.cost, cost));
    result.distance = hn::IfThenElse(hn::Lt(cost, result.cost), hn::Add(reference, shift), result.distance);
    result.cost = hn::Min(result.cost, cost);
  }
  return result;
}

/// Phasor of each frequency, in counts.
template <std::size_t Bands, class D, class V = hn::Vec<D>> struct Phasors {
  V x[Bands], y[Bands], square[Bands];
  V amplitude, rest;  ///< mean of all; sum of squared residuals of the fits
  TapSums<D> sums;
};

template <std::size_t Bands, bool Taps, class T, class D>
HWY_INLINE Phasors<Bands, D> FitPhasors(D d, const PhaseSettings& s, const DecoderImages& images, std::size_t i) {
  using V = hn::Vec<D>;
  const T* from = static_cast<const T*>(images.samples) + i;
  Phasors<Bands, D> p;
  p.sums = {hn::Zero(hn::RebindToSigned<D>()), hn::Zero(hn::Rebind<std::uint16_t, D>())};
  p.amplitude = hn::Zero(d);
  p.rest = hn::Zero(d);
  for (std::size_t b = 0; b < Bands; ++b) {
    const Band& band = s.bands[b];
    const std::size_t count = band.image.size();
    V c[physics::max_exposures];
    p.x[b] = p.y[b] = hn::Zero(d);
    for (std::size_t j = 0; j < count; ++j) {
      if constexpr (Taps)
        c[j] = LoadTaps(d, from + 2 * band.image[j] * images.pixels, images.pixels, p.sums);
      else
        c[j] = LoadFloat(d, from + band.image[j] * images.pixels);
      p.x[b] = hn::MulAdd(hn::Set(d, band.cosine[j]), c[j], p.x[b]);
      p.y[b] = hn::MulAdd(hn::Set(d, band.sine[j]), c[j], p.y[b]);
    }
    for (std::size_t r = 0; r < band.rest.size(); r += count) {
      V along = hn::Zero(d);
      for (std::size_t j = 0; j < count; ++j) along = hn::MulAdd(hn::Set(d, band.rest[r + j]), c[j], along);
      p.rest = hn::MulAdd(along, along, p.rest);
    }
    p.square[b] = hn::MulAdd(p.x[b], p.x[b], hn::Mul(p.y[b], p.y[b]));
    p.amplitude = hn::Add(p.amplitude, hn::Sqrt(p.square[b]));
  }
  p.amplitude = hn::Mul(p.amplitude, hn::Set(d, s.each));
  return p;
}

/// Wrapped distance of each frequency with its variance and weight.
template <std::size_t Bands, class D, class V = hn::Vec<D>> struct Wrapped {
  V distance[Bands], variance[Bands], weight[Bands];
  V sum, steepest;  ///< sum of the weights; the largest variance of a phase, rad^2
};

/// @param variance of a sample
template <std::size_t Bands, class D, class V = hn::Vec<D>>
HWY_INLINE Wrapped<Bands, D> WrappedDistances(D d, const PhaseSettings& s, const Phasors<Bands, D>& p, V variance) {
  Wrapped<Bands, D> w;
  w.sum = hn::Zero(d);
  w.steepest = hn::Zero(d);
  for (std::size_t b = 0; b < Bands; ++b) {
    const Band& band = s.bands[b];
    const V x = p.x[b], y = p.y[b];
    const V scale = hn::Set(d, s.metres_per_radian[b]);
    w.distance[b] = physics::HWY_NAMESPACE::WrappedDistance(d, y, x, scale, hn::Set(d, s.range[b]));
    // Variance of atan2(y, x).
    const V across =
        hn::MulAdd(hn::Mul(x, x), hn::Set(d, band.yy),
                   hn::NegMulAdd(hn::Mul(x, y), hn::Set(d, 2 * band.xy), hn::Mul(hn::Mul(y, y), hn::Set(d, band.xx))));
    const V of_phase = hn::Div(hn::Mul(variance, across), hn::Mul(p.square[b], p.square[b]));
    const V scale2 = hn::Mul(scale, scale);
    w.variance[b] = hn::Mul(scale2, of_phase);
    w.steepest = hn::Max(w.steepest, of_phase);
    if constexpr (Bands > 1) {
      w.weight[b] = hn::Div(hn::Set(d, 1.0F), hn::Mul(scale2, hn::Add(of_phase, hn::Set(d, s.phase_variance))));
      w.sum = hn::Add(w.sum, w.weight[b]);
    }
  }
  return w;
}

/// Combined distance over all wraps with its variance; raises the flags of uncertain results.
template <class D, class V = hn::Vec<D>> struct Unwrapped { V distance, variance; };

template <std::size_t Bands, class D, class V = hn::Vec<D>, class Flags>
HWY_INLINE Unwrapped<D> Combine(D d, const PhaseSettings& s, const Wrapped<Bands, D>& w, Flags& flags) {
  const V inverse = hn::Div(hn::Set(d, 1.0F), w.sum);
  const Likeliest<D> best = Unwrap<Bands>(d, s, w.distance, w.weight, inverse);
  Unwrapped<D> result{best.distance, hn::Zero(d)};
  const V repeat = hn::Set(d, s.repeat);
  if (s.repeat > 0) {
    result.distance =
        hn::IfThenElse(hn::Lt(result.distance, hn::Zero(d)), hn::Add(result.distance, repeat), result.distance);
    result.distance =
        hn::IfThenElse(hn::Ge(result.distance, repeat), hn::Sub(result.distance, repeat), result.distance);
  }
  for (std::size_t b = 0; b < Bands; ++b) {
    const V share = hn::Mul(w.weight[b], inverse);
    result.variance = hn::MulAdd(hn::Mul(share, share), w.variance[b], result.variance);
  }
  const auto near = hn::Lt(hn::Sub(best.second, best.cost), hn::Set(d, s.wrapped_below));
  Raise(d, flags, hn::Or(near, hn::Gt(w.steepest, hn::Set(d, s.steepest))), flag::wrapped);
  const V beyond = hn::Max(hn::Neg(result.distance), hn::Sub(result.distance, hn::Set(d, s.max_range)));
  Raise(d, flags, hn::Gt(beyond, hn::Mul(hn::Set(d, s.margin), hn::Sqrt(result.variance))), flag::wrapped);
  Raise(d, flags, hn::Gt(best.cost, hn::Set(d, s.wrong_above)), flag::wrapped);
  Raise(d, flags, hn::Gt(best.cost, hn::Set(d, s.disagree_above)), flag::inconsistent);
  return result;
}

/// Decodes a vector of pixels starting at pixel i. `Taps`: T is the type of the taps, else of the phases.
template <std::size_t Bands, bool Taps, class T, class D>
HWY_INLINE void DecodeAt(D d, const PhaseSettings& s, const DecoderImages& images, std::size_t i) {
  using V = hn::Vec<D>;
  const Phasors<Bands, D> p = FitPhasors<Bands, Taps, T>(d, s, images, i);
  const V intensity = Taps ? hn::Mul(hn::ConvertTo(d, p.sums.sum), hn::Set(d, s.intensity_scale))
                           : hn::Mul(p.amplitude, hn::Set(d, s.counts.intensity_per_amplitude));
  const V tap_variance = hn::MulAdd(hn::Set(d, s.counts.shot_noise), intensity, hn::Set(d, s.counts.read_variance));
  const V variance = hn::MulAdd(hn::Set(d, 2.0F), tap_variance, hn::Set(d, s.any_variance));

  auto flags = LoadFlags(d, images.flags + i);
  const Wrapped<Bands, D> wrapped = WrappedDistances<Bands>(d, s, p, variance);
  Unwrapped<D> result{wrapped.distance[0], wrapped.variance[0]};
  if constexpr (Bands > 1) result = Combine<Bands>(d, s, wrapped, flags);
  Raise(d, flags, hn::Gt(p.rest, hn::Mul(variance, hn::Set(d, s.rest_above))), flag::inconsistent);
  // Without light, or with NaN samples, there is no phase.
  auto measured = hn::Lt(p.amplitude, hn::Set(d, hwy::HighestValue<float>()));
  for (std::size_t b = 0; b < Bands; ++b) measured = hn::And(measured, hn::Gt(p.square[b], hn::Zero(d)));
  measured = hn::And(measured, hn::Lt(hn::Abs(result.distance), hn::Set(d, hwy::HighestValue<float>())));
  const auto valid = StorePixels<Taps>(d, s.counts, images, i, p.sums,
                                       Pixels<D>{flags, result.distance, p.amplitude, intensity, measured});
  if (images.sigma != nullptr)
    hn::StoreU(hn::IfThenElse(valid, hn::Sqrt(result.variance), hn::NaN(d)), d, images.sigma + i);
}

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
