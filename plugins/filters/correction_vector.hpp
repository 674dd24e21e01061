// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Table lookup of corrections, compiled for each instruction set. For model_correction.cpp only.
#if defined(TOFGRAPH_CORRECTION_VECTOR) == defined(HWY_TARGET_TOGGLE)
#ifdef TOFGRAPH_CORRECTION_VECTOR
#undef TOFGRAPH_CORRECTION_VECTOR
#else
#define TOFGRAPH_CORRECTION_VECTOR
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Positions of pixels between the nodes: the first of four nodes, and the fractions along distance and amplitude.
struct NodePlaces {
  static constexpr std::size_t size = 64;
  HWY_ALIGN std::int32_t node[size];
  HWY_ALIGN float along[size], across[size], lifted[size], factor[size];
};

/// @param distance, amplitude of NodePlaces::size pixels
template <bool Amplitude> HWY_INLINE void FindPlaces(const CorrectionLookup& in, const float* distance,
                                                     const float* amplitude, NodePlaces& places) {
  const hn::CappedTag<float, 16> d;
  const hn::RebindToSigned<decltype(d)> di;
  const auto zero = hn::Zero(d), range = hn::Set(d, in.range), first = hn::Set(d, in.first);
  for (std::size_t j = 0; j < NodePlaces::size; j += hn::Lanes(d)) {
    auto shift = hn::Set(d, in.shifts[0]);
    auto line = hn::Zero(di);
    if constexpr (Amplitude) {
      const auto weakest = hn::Set(d, in.weakest);
      const auto given = hn::LoadU(d, amplitude + j);
      const auto light =
          hn::Min(hn::Max(hn::IfThenElse(hn::Eq(given, given), given, weakest), weakest), hn::Set(d, in.strongest));
      // The bits of a float number its octaves and, below them, equal parts of one.
      constexpr int part_bits = 23 - std::countr_zero(simulation::nodes_per_octave);
      const auto bits = hn::Sub(hn::BitCast(di, light), hn::BitCast(di, weakest));
      const auto last = hn::Set(di, static_cast<std::int32_t>(in.amplitudes) - 2);
      line = hn::Min(hn::ShiftRight<part_bits>(bits), last);
      const auto rest = hn::Sub(bits, hn::ShiftLeft<part_bits>(line));
      const auto across = hn::Mul(hn::ConvertTo(d, rest), hn::Set(d, 1.0F / (1 << part_bits)));
      hn::Store(across, d, places.across + j);
      const auto weak = hn::GatherIndex(d, in.shifts, line), strong = hn::GatherIndex(d, in.shifts + 1, line);
      shift = hn::MulAdd(across, hn::Sub(strong, weak), weak);
    }
    auto beyond = hn::Sub(hn::Sub(hn::LoadU(d, distance + j), shift), first);
    beyond = hn::Add(beyond, hn::IfThenElseZero(hn::Lt(beyond, zero), range));
    beyond = hn::Sub(beyond, hn::IfThenElseZero(hn::Ge(beyond, range), range));
    hn::Store(hn::Add(beyond, first), d, places.lifted + j);
    const auto number = hn::IfThenElseZero(hn::Eq(beyond, beyond), beyond);  // NaN: any value
    const auto along = hn::Min(hn::Max(hn::Mul(number, hn::Set(d, in.per_step)), zero),
                               hn::Set(d, static_cast<float>(in.distances - 1)));
    const auto cell = hn::Min(hn::ConvertTo(di, along), hn::Set(di, static_cast<std::int32_t>(in.distances) - 2));
    hn::Store(hn::Sub(along, hn::ConvertTo(d, cell)), d, places.along + j);
    const auto node = hn::Add(cell, hn::Mul(line, hn::Set(di, static_cast<std::int32_t>(in.distances))));
    hn::Store(node, di, places.node + j);
  }
}

/// Interpolated correction, added to the pixel's lifted distance, and the factor of sigma.
template <std::size_t Lanes, bool Amplitude>
HWY_INLINE void Mix(const CorrectionLookup& in, std::size_t i, std::size_t count, NodePlaces& places) {
  const hn::CappedTag<float, Lanes> d;
  const std::size_t step = hn::Lanes(d), next_line = in.distances * Lanes;
  HWY_ALIGN float mixed[Lanes];
  for (std::size_t j = 0; j < count; ++j) {
    const float* node = in.nodes + static_cast<std::size_t>(places.node[j]) * Lanes;
    const float* pixel = in.pixels + (i + j) * Lanes;
    const auto along = hn::Set(d, places.along[j]);
    auto sum = hn::Zero(d);
    for (std::size_t lane = 0; lane < Lanes; lane += step) {
      const auto line = [&](const float* at) {
        const auto low = hn::LoadU(d, at + lane);
        return hn::MulAdd(along, hn::Sub(hn::LoadU(d, at + Lanes + lane), low), low);
      };
      auto value = line(node);
      if constexpr (Amplitude)
        value = hn::MulAdd(hn::Set(d, places.across[j]), hn::Sub(line(node + next_line), value), value);
      sum = hn::MulAdd(value, hn::LoadU(d, pixel + lane), sum);
      hn::Store(value, d, mixed + lane);
    }
    places.lifted[j] += hn::GetLane(hn::SumOfLanes(d, sum));
    places.factor[j] = mixed[Lanes - 1];
  }
}

/// Corrects distance, sigma and flags of whole vectors of pixels.
template <class D>
HWY_INLINE void FinishSome(D d, const CorrectionLookup& in, std::size_t i, const NodePlaces& places, std::size_t j) {
  const hn::RebindToSigned<D> di;
  const hn::Rebind<std::uint16_t, D> du16;
  const auto range = hn::Set(d, in.range), distance = hn::LoadU(d, places.lifted + j);
  hn::StoreU(hn::Sub(distance, hn::IfThenElseZero(hn::Ge(distance, range), range)), d, in.distance + i);
  const auto factor = hn::LoadU(d, places.factor + j);
  if (in.sigma != nullptr) hn::StoreU(hn::Mul(hn::LoadU(d, in.sigma + i), factor), d, in.sigma + i);
  const auto valid = hn::Eq(distance, distance);
  const auto steep = hn::And(valid, hn::Or(hn::Gt(factor, hn::Set(d, simulation::steep_factor)),
                                           hn::Lt(factor, hn::Set(d, 1 / simulation::steep_factor))));
  auto flags = hn::PromoteTo(di, hn::LoadU(du16, in.flags + i));
  flags = hn::Or(flags, hn::IfThenElseZero(hn::RebindMask(di, steep), hn::Set(di, flag::inconsistent)));
  if (in.amplitude != nullptr) {
    const auto amplitude = hn::LoadU(d, in.amplitude + i);
    const auto outside = hn::Or(hn::Lt(amplitude, hn::Set(d, in.weakest)), hn::Gt(amplitude, hn::Set(d, in.strongest)));
    flags = hn::Or(flags, hn::IfThenElseZero(hn::RebindMask(di, outside), hn::Set(di, flag::extrapolated)));
  }
  hn::StoreU(hn::DemoteTo(du16, flags), du16, in.flags + i);
}

HWY_INLINE void Finish(const CorrectionLookup& in, std::size_t i, std::size_t count, const NodePlaces& places) {
  const hn::CappedTag<float, 16> d;
  const hn::CappedTag<float, 1> single;
  std::size_t j = 0;
  for (; j + hn::Lanes(d) <= count; j += hn::Lanes(d)) FinishSome(d, in, i + j, places, j);
  for (; j < count; ++j) FinishSome(single, in, i + j, places, j);
}

template <std::size_t Lanes, bool Amplitude> void LookUpAll(const CorrectionLookup& in) {
  NodePlaces places;
  for (std::size_t i = 0; i < in.count; i += NodePlaces::size) {
    const std::size_t count = std::min(NodePlaces::size, in.count - i);
    if (count == NodePlaces::size) {
      FindPlaces<Amplitude>(in, in.distance + i, Amplitude ? in.amplitude + i : nullptr, places);
    } else {
      float distance[NodePlaces::size] = {}, amplitude[NodePlaces::size] = {};
      std::copy_n(in.distance + i, count, distance);
      if (Amplitude) std::copy_n(in.amplitude + i, count, amplitude);
      FindPlaces<Amplitude>(in, distance, amplitude, places);
    }
    Mix<Lanes, Amplitude>(in, i, count, places);
    Finish(in, i, count, places);
  }
}

template <std::size_t Lanes> void LookUpLanes(const CorrectionLookup& in) {
  if (in.amplitudes > 1)
    LookUpAll<Lanes, true>(in);
  else
    LookUpAll<Lanes, false>(in);
}

void LookUp(const CorrectionLookup& in) {
  if (in.lanes == 4)
    LookUpLanes<4>(in);
  else if (in.lanes == 8)
    LookUpLanes<8>(in);
  else
    LookUpLanes<16>(in);
}

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
