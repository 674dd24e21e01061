// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Sums over a window and the resulting variance of the mean, for files that are compiled once per processor (Highway's
/// foreach_target).
///
/// The weights depend on the noisy lengths, so the mean's variance is not that of fixed weights. To first order it is
/// sum_j (df/dz_j)^2 sigma_j^2, with f = z + sum w d / W, d = z_j - z, W = sum w, and g the shares of a patch's pixels
/// (one pixel: g_0 = 1). V is the weighted variance of the window's lengths, c = 2 / h^2 (1 / h^2 beside a guide):
///
///   centre       1 / W + a, a = c g_0 V: if the centre rises, so do the weights of what lies above
///   neighbours   w_j / W, of which the change of their own weights leaves (1 + 2 u^2) / (1 + u)^2 of the variance;
///                u = c (v_n g_0 + v_s), the mean over normally distributed lengths
///   patch        c g_k v_s: what the patch's other pixels do to the weights, where the surface slopes; together with
///                their own weights w_k / W (1 - c v_s)
///
/// V = v_n + v_s, the parts of the noise and of the surface; v_n = (s^2 - S) / (1 + c g_0 s^2), with s^2 the mean of
/// sigma^2 and S the variance that fixed weights would give. The squares of a and c v_s, which are estimates from
/// s^2 / S pixels, exceed those of their means; half of this excess is no variance of the mean, and is taken off.
#if defined(TOFGRAPH_FILTERS_SPREAD_VECTOR_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef TOFGRAPH_FILTERS_SPREAD_VECTOR_HPP
#undef TOFGRAPH_FILTERS_SPREAD_VECTOR_HPP
#else
#define TOFGRAPH_FILTERS_SPREAD_VECTOR_HPP
#endif

#include <hwy/highway.h>

#include <numbers>

#include "plugins/filters/window_images.hpp"

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Kinds of weights, distinguished by their effect on the variance of the mean.
enum class Spread {
  none,     // sigma is unknown
  pixels,   // weights by the difference of two pixels
  patches,  // by the difference of two patches
  floored,  // as patches, but those at the floor have weight 1 and do not change
};

/// Sums over a window around a vector of pixels.
template <Spread Kind, class D> struct WindowSums {
  using V = hn::Vec<D>;
  V centre, softness, own;           // own: the variance of the centre
  V weights, differences;            // including the centre, with weight 1 and difference 0
  V squares, variance, noise;        // sums of w d^2; of w^2 sigma^2 and w sigma^2 without the centre
  V free_differences, free_squares;  // over the pixels whose weights are not at the floor

  HWY_INLINE void Start(D d, V centre_length, V centre_softness, V centre_variance) {
    centre = centre_length;
    softness = centre_softness;
    own = centre_variance;
    weights = hn::Set(d, 1.0F);
    differences = squares = variance = noise = free_differences = free_squares = hn::Zero(d);
  }

  /// Adds a pixel; its length enters as the difference from the centre, so that a constant image is reproduced to the
  /// last bit.
  HWY_INLINE void Add(D d, V weight, V difference, const float* from) {
    weights = hn::Add(weights, weight);
    differences = hn::NegMulAdd(weight, difference, differences);
    if constexpr (Kind == Spread::none) return;
    V moment = hn::Mul(weight, difference);
    squares = hn::MulAdd(moment, difference, squares);
    const V noisy = hn::Mul(weight, hn::LoadU(d, from));
    variance = hn::MulAdd(weight, noisy, variance);
    if constexpr (Kind == Spread::pixels) return;
    noise = hn::Add(noise, noisy);
    if constexpr (Kind != Spread::floored) return;
    moment = hn::IfThenElseZero(hn::Lt(weight, hn::Set(d, 0.999999F)), moment);  // 2^0 is 0.99999926
    free_differences = hn::Sub(free_differences, moment);
    free_squares = hn::MulAdd(moment, difference, free_squares);
  }
};

/// Returns the value if it is positive or NaN, else 0.
template <class D, class V = hn::Vec<D>> HWY_INLINE V PositivePart(D d, V value) {
  return hn::IfThenZeroElse(hn::Lt(value, hn::Zero(d)), value);
}

/// Factor of the neighbours' variance due to the change of their own weights.
template <class D, class V = hn::Vec<D>> HWY_INLINE V NeighboursShare(D d, V u) {
  const V one = hn::Set(d, 1.0F), more = hn::Add(one, u);
  return hn::Div(hn::MulAdd(hn::Add(u, u), u, one), hn::Mul(more, more));
}

constexpr float sensitivity = 2 * std::numbers::ln2_v<float>;  // c, with lengths in units of h / sqrt(ln 2)

/// Variance of the mean if weights compare pixels, m^2. @param inverse 1 / W
template <class D, class V = hn::Vec<D>>
HWY_INLINE V MeanVariance(D d, const WindowSums<Spread::pixels, D>& sums, V inverse) {
  const V mean = hn::Mul(sums.differences, inverse);
  const V spread = PositivePart(d, hn::NegMulAdd(mean, mean, hn::Mul(sums.squares, inverse)));
  const V a = hn::Mul(hn::Mul(hn::Set(d, sensitivity), hn::Mul(sums.softness, sums.softness)), spread);
  const V centre = hn::Add(inverse, a), neighbours = hn::Mul(sums.variance, hn::Mul(inverse, inverse));
  const V fixed = hn::MulAdd(sums.own, hn::Mul(inverse, inverse), neighbours);
  const V moved = hn::NegMulAdd(hn::Mul(a, a), hn::Min(sums.own, fixed), hn::Mul(sums.own, hn::Mul(centre, centre)));
  return hn::MulAdd(neighbours, NeighboursShare(d, a), moved);
}

/// Shares of a patch's pixels: that of the centre, and the sum of the squares of all others. In a robust patch noisy
/// pixels count less: by 1 / (1 + closeness) on average, closeness = sigma^2 / (4 h^2), 0 in others. Their dependence
/// on the centre would add closeness / 2 times the others' share to that of the centre, for every noise; by Monte Carlo
/// 0.4 of that is right, a compromise between patches that differ only by noise and those on slopes.
template <class D> struct PatchShares {
  hn::Vec<D> middle, pull, squares;

  /// @param valid sum of the shares over the valid pixels of the patch
  HWY_INLINE PatchShares(D d, const Patch& patch, hn::Vec<D> valid, hn::Vec<D> closeness) {
    float sum = 0;
    for (const float factor : patch.factors) sum += factor * factor;
    const float factor = patch.factors[static_cast<std::size_t>(patch.radius)], share = factor * factor;
    const auto one = hn::Set(d, 1.0F), first = hn::Set(d, share);
    const auto less = hn::Div(one, hn::Add(one, closeness));
    const auto scale = hn::Div(one, hn::MulAdd(hn::Sub(valid, first), less, first)), others = hn::Mul(less, scale);
    middle = hn::Mul(first, scale);
    pull = hn::MulAdd(hn::Mul(hn::Set(d, 0.2F), closeness), hn::Sub(one, middle), middle);
    squares = hn::Mul(hn::Set(d, sum * sum - share * share), hn::Mul(others, others));
  }
};

/// Variance of the mean if weights compare patches, m^2. @param valid see PatchShares
template <Spread Kind, class D, class V = hn::Vec<D>>
HWY_INLINE V MeanVariance(D d, const WindowFrame& f, const WindowSums<Kind, D>& sums, V inverse, V valid) {
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0F), tiny = hn::Set(d, 1e-30F);
  const V per_unit = hn::Set(d, 1 / (f.unit * f.unit)), inverse2 = hn::Mul(inverse, inverse);
  const V closeness =
      Kind == Spread::floored ? hn::Mul(hn::Mul(sums.own, per_unit), hn::Set(d, std::numbers::ln2_v<float> / 4)) : zero;
  const PatchShares<D> shares(d, f.patch, valid, closeness);
  const V c = hn::Mul(hn::Set(d, f.patch.guide_scale > 0 ? sensitivity / 2 : sensitivity),
                      hn::Mul(sums.softness, sums.softness));
  const V mean = hn::Mul(sums.differences, inverse);
  const V spread = PositivePart(d, hn::NegMulAdd(mean, mean, hn::Mul(sums.squares, inverse)));
  V free = spread;  // part with variable weights
  if constexpr (Kind == Spread::floored) {
    const V moment = hn::NegMulAdd(mean, sums.free_differences, sums.free_squares);
    free = hn::Min(PositivePart(d, hn::Mul(moment, inverse)), spread);
  }
  const V level = hn::Mul(hn::Mul(hn::Add(sums.noise, sums.own), inverse), per_unit);  // s^2
  const V fixed = hn::Mul(hn::Add(sums.variance, sums.own), inverse2);                 // S
  const V noise = hn::Div(hn::Mul(hn::NegMulAdd(fixed, per_unit, level), spread),
                          hn::MulAdd(hn::Mul(c, shares.middle), hn::Mul(free, level), hn::Add(spread, tiny)));
  const V surface = hn::Mul(c, hn::Min(PositivePart(d, hn::Sub(spread, noise)), free));
  const V a = hn::Mul(hn::Mul(c, shares.pull), free), centre = hn::Add(inverse, a);
  const V u = hn::MulAdd(shares.middle, hn::MulSub(c, free, surface), surface);
  const V squares = hn::Mul(hn::Mul(surface, surface), shares.squares);
  const V typical = hn::Div(hn::Mul(sums.variance, inverse), hn::Add(sums.noise, tiny));  // w_k / W
  const V both = hn::Mul(hn::Mul(hn::Add(surface, surface), hn::Sub(one, shares.middle)),
                         hn::Mul(typical, PositivePart(d, hn::Sub(one, surface))));
  const V first = hn::Mul(sums.own, hn::MulAdd(centre, centre, hn::Add(squares, both)));
  const V moved = hn::NegMulAdd(hn::MulAdd(a, a, squares), hn::Min(sums.own, fixed), first);
  return hn::MulAdd(hn::Mul(sums.variance, inverse2), NeighboursShare(d, u), moved);
}

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
