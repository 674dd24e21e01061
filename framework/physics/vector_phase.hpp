// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Phase of many pixels at once, for code that is compiled once per processor target (Highway's foreach_target):
/// include it after <hwy/foreach_target.h>. The guard is Highway's idiom for a header that is compiled several times.
#if defined(TOFGRAPH_PHYSICS_VECTOR_PHASE_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef TOFGRAPH_PHYSICS_VECTOR_PHASE_HPP
#undef TOFGRAPH_PHYSICS_VECTOR_PHASE_HPP
#else
#define TOFGRAPH_PHYSICS_VECTOR_PHASE_HPP
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tofgraph::physics::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// atan(t) for 0 <= t <= 1: odd minimax polynomial of degree 15 with a maximum error of 3.75e-8 rad; with the rounding
/// of float arithmetic below 1.2e-7 rad.
template <class D, class V = hn::Vec<D>> HWY_INLINE V AtanToOne(D d, V t) {
  constexpr float c[] = {9.999993356601388e-1F, -3.332986107930474e-1F, 1.9946568820775706e-1F, -1.3908643991372088e-1F,
                         9.642230114508069e-2F, -5.591271647337052e-2F, 2.1863189557017375e-2F, -4.05462146207399e-3F};
  const V s = hn::Mul(t, t);
  V p = hn::Set(d, c[7]);
  for (int i = 6; i >= 1; --i) p = hn::MulAdd(p, s, hn::Set(d, c[i]));
  return hn::MulAdd(hn::Mul(t, s), p, hn::Mul(t, hn::Set(d, c[0])));
}

/// metres_per_radian * atan2(sine, cosine) wrapped to [0, range), where range is 2 pi metres_per_radian. The angle is
/// reduced to 0..pi/4 and scaled before it is unfolded, so that the result is within 1.5 units in the last place of the
/// range. NaN where both are 0; meaningless where one is not finite.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V WrappedDistance(D d, V sine, V cosine, V metres_per_radian, V range) {
  const V zero = hn::Zero(d), tall = hn::Abs(sine), wide = hn::Abs(cosine);
  const V half = hn::Mul(range, hn::Set(d, 0.5F)), quarter = hn::Mul(range, hn::Set(d, 0.25F));
  V distance = hn::Mul(metres_per_radian, AtanToOne(d, hn::Div(hn::Min(tall, wide), hn::Max(tall, wide))));
  distance = hn::IfThenElse(hn::Gt(tall, wide), hn::Sub(quarter, distance), distance);
  distance = hn::IfThenElse(hn::Lt(cosine, zero), hn::Sub(half, distance), distance);
  distance = hn::IfThenElse(hn::Lt(sine, zero), hn::Sub(range, distance), distance);
  return hn::IfThenZeroElse(hn::Ge(distance, range), distance);
}

}  // namespace tofgraph::physics::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
