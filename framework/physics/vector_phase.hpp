// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The phase of many pixels at once, for code that is compiled once a processor (Highway's foreach_target): include
/// it after <hwy/foreach_target.h>. The guard is Highway's idiom for a header that is compiled as often as that.
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

/// atan(t) for 0 <= t <= 1: the odd polynomial of degree 17 with the least greatest error, which is 5.8e-9 rad; with
/// the rounding of float arithmetic below 7e-8 rad.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V AtanToOne(D d, V t) {
  constexpr float c[] = {9.999998863996528e-1F,  -3.333259711351035e-1F, 1.998590809910602e-1F,
                         -1.416123822917055e-1F, 1.049897784962195e-1F,  -7.234919899058867e-2F,
                         3.978191852464163e-2F,  -1.440176541188778e-2F, 2.456822569653995e-3F};
  const V s = hn::Mul(t, t);
  V p = hn::Set(d, c[8]);
  for (int i = 7; i >= 1; --i) p = hn::MulAdd(p, s, hn::Set(d, c[i]));
  return hn::MulAdd(hn::Mul(t, s), p, hn::Mul(t, hn::Set(d, c[0])));
}

/// metres_per_radian * atan2(sine, cosine) wrapped to [0, range), where range is 2 pi metres_per_radian. The angle is
/// reduced to 0..pi/4 and scaled before the quarter turns are added, so that the result is within 1.5 units in the last
/// place of the range. NaN where both are 0 or one is not finite.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V WrappedDistance(D d, V sine, V cosine, V metres_per_radian, V range) {
  const V zero = hn::Zero(d);
  const V tall = hn::Abs(sine), wide = hn::Abs(cosine);
  const auto steep = hn::Gt(tall, wide);
  const V within = hn::Mul(metres_per_radian, AtanToOne(d, hn::Div(hn::Min(tall, wide), hn::Max(tall, wide))));
  const V half = hn::Mul(range, hn::Set(d, 0.5F));
  V base = hn::IfThenElseZero(steep, hn::Mul(range, hn::Set(d, 0.25F)));
  auto minus = steep;
  const auto left = hn::Lt(cosine, zero);
  base = hn::IfThenElse(left, hn::Sub(half, base), base);
  minus = hn::Xor(minus, left);
  const auto below = hn::Lt(sine, zero);
  base = hn::IfThenElse(below, hn::Sub(range, base), base);
  minus = hn::Xor(minus, below);
  const V distance = hn::Add(base, hn::IfThenElse(minus, hn::Neg(within), within));
  return hn::IfThenElse(hn::Ge(distance, range), zero, distance);
}

}  // namespace tofgraph::physics::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
