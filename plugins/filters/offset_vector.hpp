// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Vector code of offset_correction for the pixels of a row, compiled once per processor (Highway's foreach_target):
/// include it after <hwy/foreach_target.h>. The guard is Highway's idiom for such a header.
#if defined(TOFGRAPH_FILTERS_OFFSET_VECTOR_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef TOFGRAPH_FILTERS_OFFSET_VECTOR_HPP
#undef TOFGRAPH_FILTERS_OFFSET_VECTOR_HPP
#else
#define TOFGRAPH_FILTERS_OFFSET_VECTOR_HPP
#endif

#include <hwy/highway.h>
// The order matters: Highway first.
#include <hwy/contrib/math/math-inl.h>
#include <tofgraph/physics/offset_table.hpp>

#include <cstddef>
#include <limits>

#include "plugins/filters/offset_rows.hpp"

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Mean path from the sources to the pixels' points at D_ref = r.
template <class D, class V = hn::Vec<D>> HWY_INLINE V MeanPath(D d, const OffsetRow& row, std::size_t u, V r) {
  V mean = hn::Zero(d);
  const V square = hn::Mul(r, r), twice = hn::Add(r, r);
  for (std::size_t s = 0; s < row.source_count; ++s) {
    const V along = hn::LoadU(d, row.sources[s].along + row.first + u);
    const V path = hn::Sqrt(hn::MulAdd(twice, along, hn::Add(square, hn::Set(d, row.sources[s].square))));
    mean = hn::MulAdd(hn::Set(d, row.sources[s].weight), path, mean);
  }
  return mean;
}

/// Computes D_ref from the measured distance, by one Newton step from the solution for a single source at the sources'
/// centre; then depth and reflectivity.
template <class D, class V = hn::Vec<D>> HWY_INLINE void LookAt(D d, const OffsetRow& row, std::size_t u) {
  const V distance = hn::LoadU(d, row.distance + u), along = hn::LoadU(d, row.mean_along + u);
  const V k = hn::Sub(hn::Add(distance, distance), hn::LoadU(d, row.sensor_path + u)), sum = hn::Add(k, along);
  const V inverse = hn::Div(hn::Set(d, 1.0F), sum);
  V r = hn::Mul(hn::MulSub(k, k, hn::Set(d, row.mean_square)), hn::Mul(hn::Set(d, 0.5F), inverse));
  const V rest = hn::Sub(hn::Add(MeanPath(d, row, u, r), r), k);
  r = hn::NegMulAdd(rest, hn::Mul(hn::Sub(k, r), inverse), r);
  hn::StoreU(r, d, row.path + u);
  hn::StoreU(hn::MulAdd(r, hn::LoadU(d, row.cosine + u), hn::Set(d, row.focal_length)), d, row.depth + u);
  V reflectivity = hn::Set(d, 1.0F);
  if (row.amplitude != nullptr) {
    const V light = hn::Mul(hn::LoadU(d, row.amplitude + u), hn::Mul(distance, distance));
    reflectivity = hn::Mul(light, hn::Mul(hn::LoadU(d, row.brightness + u), hn::Set(d, row.rate)));
  }
  hn::StoreU(reflectivity, d, row.reflectivity + u);
}

/// Means of depth and reflectivity over the neighbours along one direction that belong to the same surface.
template <class D, class V = hn::Vec<D>> HWY_INLINE void AverageAt(D d, const AverageRow& row, std::size_t u) {
  const V z = hn::LoadU(d, row.depth + u), r = hn::LoadU(d, row.reflectivity + u), one = hn::Set(d, 1.0F);
  const V depth_limit = hn::Mul(z, hn::Set(d, row.depth_limit)), limit = hn::Mul(r, hn::Set(d, row.limit));
  V sum_z = z, sum_r = r, count = one;
  for (std::ptrdiff_t k = -row.half; k <= row.half; ++k) {
    if (k == 0) continue;
    const V beside_z = hn::LoadU(d, row.depth + k * row.step + static_cast<std::ptrdiff_t>(u));
    const V beside_r = hn::LoadU(d, row.reflectivity + k * row.step + static_cast<std::ptrdiff_t>(u));
    const auto same =
        hn::And(hn::Le(hn::Abs(hn::Sub(beside_z, z)), depth_limit), hn::Le(hn::Abs(hn::Sub(beside_r, r)), limit));
    sum_z = hn::Add(sum_z, hn::IfThenElseZero(same, beside_z));
    sum_r = hn::Add(sum_r, hn::IfThenElseZero(same, beside_r));
    count = hn::Add(count, hn::IfThenElseZero(same, one));
  }
  const V share = hn::Div(one, count);
  hn::StoreU(hn::Mul(sum_z, share), d, row.mean_depth + u);
  hn::StoreU(hn::Mul(sum_r, share), d, row.mean_reflectivity + u);
}

/// Depth of a pixel in nodes of the grid from the first, and its node before.
template <class D> struct Along {
  using V = hn::Vec<D>;
  V place, last, inside;
  hn::Vec<hn::RebindToSigned<D>> node;

  HWY_INLINE Along(D d, const OffsetRow& row, const OffsetPlane& plane, std::size_t u)
      : place(hn::Mul(hn::Sub(hn::LoadU(d, row.depth + u), hn::Set(d, plane.first)), hn::Set(d, plane.per_metre))),
        last(hn::Set(d, static_cast<float>(plane.depths) - 1.001F)),
        // NaN compares as false and becomes 0.
        inside(hn::Min(hn::IfThenElseZero(hn::Gt(place, hn::Zero(d)), place), last)),
        node(hn::ConvertTo(hn::RebindToSigned<D>(), inside)) {}
};

/// Reflectivity of pixels; without light: the lowest level.
template <class D, class V = hn::Vec<D>> HWY_INLINE V Reflectivity(D d, const OffsetRow& row, std::size_t u) {
  const V given = hn::LoadU(d, row.reflectivity + u);
  return hn::IfThenElseZero(hn::Gt(given, hn::Zero(d)), given);
}

/// Interpolates the errors between the nodes of a grid.
template <class D, class V = hn::Vec<D>>
HWY_INLINE void InterpolateAt(D d, const OffsetRow& row, const OffsetPlane& plane, std::size_t u) {
  const hn::RebindToSigned<D> di;
  const Along<D> depth(d, row, plane, u);
  const V along = hn::Sub(depth.inside, hn::ConvertTo(d, depth.node));
  const auto from_base = hn::Sub(hn::BitCast(di, Reflectivity(d, row, u)), hn::Set(di, plane.base));
  const auto bits = hn::Min(hn::Max(from_base, hn::Zero(di)), hn::Set(di, plane.last_bits));
  const auto part = hn::And(bits, hn::Set(di, (1 << OffsetPlane::step_bits) - 1));
  const V across = hn::Mul(hn::ConvertTo(d, part), hn::Set(d, 1.0F / (1 << OffsetPlane::step_bits)));
  const auto at = hn::Add(hn::Mul(depth.node, hn::Set(di, plane.levels)), hn::ShiftRight<OffsetPlane::step_bits>(bits));
  const float* next = plane.errors + plane.levels;
  const V a = hn::GatherIndex(d, plane.errors, at), b = hn::GatherIndex(d, plane.errors + 1, at);
  const V e = hn::GatherIndex(d, next, at), f = hn::GatherIndex(d, next + 1, at);
  const V low = hn::MulAdd(across, hn::Sub(b, a), a), high = hn::MulAdd(across, hn::Sub(f, e), e);
  hn::StoreU(hn::MulAdd(along, hn::Sub(high, low), low), d, row.error + u);
}

/// Averages the errors of the nearest samples, weighted by the inverse square of their distance.
template <class D, class V = hn::Vec<D>> HWY_INLINE void WeighAt(D d, const NearestGroup& group, std::size_t i) {
  const V one = hn::Set(d, 1.0F);
  const V z = hn::Mul(hn::Sub(hn::LoadU(d, group.depth + i), hn::Set(d, group.centre)), hn::Set(d, group.per_metre));
  const V ratio = hn::MulSub(hn::LoadU(d, group.reflectivity + i), hn::Set(d, group.inverse_reflectivity), one);
  const V level = hn::Mul(hn::Log1p(d, ratio), hn::Set(d, group.per_level));
  const auto square_to = [&](std::size_t s) HWY_ATTR {
    const V dz = hn::Sub(z, hn::Set(d, group.depth_step[s])), dl = hn::Sub(level, hn::Set(d, group.level_step[s]));
    return hn::MulAdd(dz, dz, hn::MulAdd(dl, dl, hn::Set(d, group.time_square[s])));
  };
  constexpr std::size_t count = physics::OffsetTable::nearest_count;
  V nearest[count];  // squares in ascending order
  for (V& square : nearest) square = hn::Set(d, std::numeric_limits<float>::infinity());
  for (std::size_t s = 0; s < group.samples; ++s) {
    V square = square_to(s);
    for (V& held : nearest) {
      const V further = hn::Max(held, square);
      held = hn::Min(held, square);
      square = further;
    }
  }
  V sum = hn::Zero(d), weight = sum;
  for (std::size_t s = 0; s < group.samples; ++s) {
    const V square = square_to(s);
    const V share = hn::IfThenElseZero(hn::Le(square, nearest[count - 1]), hn::Div(one, square));
    sum = hn::MulAdd(share, hn::Set(d, group.sample_error[s]), sum);
    weight = hn::Add(weight, share);
  }
  hn::StoreU(hn::Div(sum, weight), d, group.error + i);
}

/// Corrects the distance and marks extrapolated offsets.
template <class D, class V = hn::Vec<D>>
HWY_INLINE void CorrectAt(D d, const OffsetRow& row, const OffsetPlane& plane, std::size_t u) {
  const hn::RebindToSigned<D> di;
  const V error = hn::LoadU(d, row.error + u), reflectivity = Reflectivity(d, row, u);
  const V further = hn::Add(hn::LoadU(d, row.path + u), hn::Div(error, hn::LoadU(d, row.cosine + u)));
  const V both = hn::Add(hn::Add(MeanPath(d, row, u, further), further), hn::LoadU(d, row.sensor_path + u));
  hn::StoreU(hn::Mul(both, hn::Set(d, 0.5F)), d, row.distance + u);
  const Along<D> depth(d, row, plane, u);
  const V least = hn::GatherIndex(d, plane.least, depth.node), most = hn::GatherIndex(d, plane.most, depth.node);
  const auto beyond = hn::Or(hn::Or(hn::Lt(depth.place, hn::Zero(d)), hn::Gt(depth.place, depth.last)),
                             hn::Not(hn::And(hn::Ge(reflectivity, least), hn::Le(reflectivity, most))));
  hn::StoreU(hn::IfThenElseZero(hn::RebindMask(di, beyond), hn::Set(di, 1)), di, row.beyond + u);
}

/// Calls at(tag, u) for whole vectors of a row's pixels, then for the remaining pixels.
template <class At> HWY_INLINE void EachPixel(std::size_t columns, const At& at) {
  const hn::ScalableTag<float> d;
  std::size_t u = 0;
  for (; u + hn::Lanes(d) <= columns; u += hn::Lanes(d)) at(d, u);
  for (; u < columns; ++u) at(hn::CappedTag<float, 1>(), u);
}

void Look(const OffsetRow& row) {
  EachPixel(row.columns, [&](auto d, std::size_t u) HWY_ATTR { LookAt(d, row, u); });
}
void Average(const AverageRow& row) {
  EachPixel(row.columns, [&](auto d, std::size_t u) HWY_ATTR { AverageAt(d, row, u); });
}
void Interpolate(const OffsetRow& row, const OffsetPlane& plane) {
  EachPixel(row.columns, [&](auto d, std::size_t u) HWY_ATTR { InterpolateAt(d, row, plane, u); });
}
void Weigh(const NearestGroup& group) {
  const hn::CappedTag<float, NearestGroup::padding> d;
  for (std::size_t i = 0; i < group.pixels; i += hn::Lanes(d)) WeighAt(d, group, i);
}
void Correct(const OffsetRow& row, const OffsetPlane& plane) {
  EachPixel(row.columns, [&](auto d, std::size_t u) HWY_ATTR { CorrectAt(d, row, plane, u); });
}

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
