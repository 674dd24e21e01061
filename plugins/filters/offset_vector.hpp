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

/// Corrects the distance and marks extrapolated offsets.
template <class D, class V = hn::Vec<D>>
HWY_INLINE void CorrectAt(D d, const OffsetRow& row, const OffsetPlane& plane, std::size_t u) {
  const hn::RebindToSigned<D> di;
  const V depth = hn::LoadU(d, row.depth + u), given = hn::LoadU(d, row.reflectivity + u);
  const V reflectivity = hn::IfThenElseZero(hn::Gt(given, hn::Zero(d)), given);  // without light: the lowest level
  const V place = hn::Mul(hn::Sub(depth, hn::Set(d, plane.first)), hn::Set(d, plane.per_metre));
  const V last = hn::Set(d, static_cast<float>(plane.depths) - 1.001F);
  // NaN compares as false and becomes 0.
  const V inside = hn::Min(hn::IfThenElseZero(hn::Gt(place, hn::Zero(d)), place), last);
  const auto z = hn::ConvertTo(di, inside);
  const V along = hn::Sub(inside, hn::ConvertTo(d, z));
  const auto bits = hn::Min(hn::Max(hn::Sub(hn::BitCast(di, reflectivity), hn::Set(di, plane.base)), hn::Zero(di)),
                            hn::Set(di, plane.last_bits));
  const auto part = hn::And(bits, hn::Set(di, (1 << OffsetPlane::step_bits) - 1));
  const V across = hn::Mul(hn::ConvertTo(d, part), hn::Set(d, 1.0F / (1 << OffsetPlane::step_bits)));
  const auto at = hn::Add(hn::Mul(z, hn::Set(di, plane.levels)), hn::ShiftRight<OffsetPlane::step_bits>(bits));
  const float* next = plane.errors + plane.levels;
  const V a = hn::GatherIndex(d, plane.errors, at), b = hn::GatherIndex(d, plane.errors + 1, at);
  const V e = hn::GatherIndex(d, next, at), f = hn::GatherIndex(d, next + 1, at);
  const V low = hn::MulAdd(across, hn::Sub(b, a), a), high = hn::MulAdd(across, hn::Sub(f, e), e);
  const V error = hn::MulAdd(along, hn::Sub(high, low), low);
  const V further = hn::Add(hn::LoadU(d, row.path + u), hn::Div(error, hn::LoadU(d, row.cosine + u)));
  const V both = hn::Add(hn::Add(MeanPath(d, row, u, further), further), hn::LoadU(d, row.sensor_path + u));
  hn::StoreU(hn::Mul(both, hn::Set(d, 0.5F)), d, row.distance + u);
  const V least = hn::GatherIndex(d, plane.least, z), most = hn::GatherIndex(d, plane.most, z);
  const auto beyond = hn::Or(hn::Or(hn::Lt(place, hn::Zero(d)), hn::Gt(place, last)),
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
void Correct(const OffsetRow& row, const OffsetPlane& plane) {
  EachPixel(row.columns, [&](auto d, std::size_t u) HWY_ATTR { CorrectAt(d, row, plane, u); });
}

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
