// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/noise.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "framework/simulation/noise.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include <hwy/contrib/math/math-inl.h>

HWY_BEFORE_NAMESPACE();
namespace tofgraph::simulation::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using U32 = hn::ScalableTag<std::uint32_t>;
using I32 = hn::RebindToSigned<U32>;
using F32 = hn::RebindToFloat<U32>;
using V = hn::Vec<U32>;

/// Upper halves of the products of 32-bit numbers.
HWY_INLINE V MulHigh(V a, V b) {
#if HWY_TARGET == HWY_SCALAR
  return V(static_cast<std::uint32_t>((std::uint64_t{a.raw} * b.raw) >> 32U));
#else
  const U32 d;
  const hn::RepartitionToWide<U32> wide;
  const auto even = hn::MulEven(a, b);
  const auto odd = hn::MulEven(hn::BitCast(d, hn::ShiftRight<32>(hn::BitCast(wide, a))),
                               hn::BitCast(d, hn::ShiftRight<32>(hn::BitCast(wide, b))));
  return hn::OddEven(hn::BitCast(d, odd), hn::BitCast(d, hn::ShiftRight<32>(even)));
#endif
}

/// Philox4x32-10 of Salmon, Moraes, Dror, Shaw: Parallel random numbers: as easy as 1, 2, 3 (SC 2011).
HWY_INLINE void Philox(V& c0, V& c1, V& c2, V& c3, std::uint32_t key0, std::uint32_t key1) {
  const U32 d;
  const V first = hn::Set(d, 0xD2511F53U), second = hn::Set(d, 0xCD9E8D57U);
  for (int round = 0; round < 10; ++round) {
    const V high0 = MulHigh(c0, first), high1 = MulHigh(c2, second);
    const V low0 = hn::Mul(c0, first), low1 = hn::Mul(c2, second);
    c0 = hn::Xor(hn::Xor(high1, c1), hn::Set(d, key0));
    c2 = hn::Xor(hn::Xor(high0, c3), hn::Set(d, key1));
    c1 = low1;
    c3 = low0;
    key0 += 0x9E3779B9U;
    key1 += 0xBB67AE85U;
  }
}

/// Uniform number, 0 < u < 1, from the upper 24 bits.
HWY_INLINE hn::Vec<F32> Uniform(V words) {
  const F32 d;
  const auto whole = hn::ConvertTo(d, hn::BitCast(I32(), hn::ShiftRight<8>(words)));
  return hn::Mul(hn::Add(whole, hn::Set(d, 0.5F)), hn::Set(d, 0x1p-24F));
}

HWY_INLINE void BoxMuller(V radius_words, V angle_words, hn::Vec<F32>& z0, hn::Vec<F32>& z1) {
  const F32 d;
  const auto radius = hn::Sqrt(hn::Mul(hn::Set(d, -2.0F), hn::Log(d, Uniform(radius_words))));
  const auto angle = hn::Mul(hn::Set(d, 6.283185307F), Uniform(angle_words));
  z0 = hn::Mul(radius, hn::Cos(d, angle));
  z1 = hn::Mul(radius, hn::Sin(d, angle));
}

void AddNoise(const NoiseStream& stream, std::size_t pixels, std::span<const float* const> mean,
              std::span<const float* const> deviation, std::span<float* const> out) {
  const U32 d;
  const F32 f;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t i = 0; i < pixels; i += lanes) {
    V c0 = hn::Iota(d, static_cast<std::uint32_t>(i));
    V c1 = hn::Set(d, static_cast<std::uint32_t>(stream.frame));
    V c2 = hn::Set(d, static_cast<std::uint32_t>(stream.frame >> 32U));
    V c3 = hn::Set(d, stream.stream);
    Philox(c0, c1, c2, c3, static_cast<std::uint32_t>(stream.seed), static_cast<std::uint32_t>(stream.seed >> 32U));
    hn::Vec<F32> z[4];
    BoxMuller(c0, c1, z[0], z[1]);
    BoxMuller(c2, c3, z[2], z[3]);
    for (std::size_t k = 0; k < mean.size(); ++k) {
      if (i + lanes <= pixels) {
        const auto value = hn::MulAdd(z[k], hn::LoadU(f, deviation[k] + i), hn::LoadU(f, mean[k] + i));
        hn::StoreU(value, f, out[k] + i);
        continue;
      }
      HWY_ALIGN float rest[HWY_MAX_BYTES / sizeof(float)];
      hn::Store(z[k], f, rest);
      for (std::size_t j = i; j < pixels; ++j) out[k][j] = mean[k][j] + deviation[k][j] * rest[j - i];
    }
  }
}

}  // namespace tofgraph::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tofgraph::simulation {

HWY_EXPORT(AddNoise);

void add_noise(const NoiseStream& stream, std::size_t pixels, std::span<const float* const> mean,
               std::span<const float* const> deviation, std::span<float* const> out) {
  HWY_DYNAMIC_DISPATCH(AddNoise)(stream, pixels, mean, deviation, out);
}

}  // namespace tofgraph::simulation
#endif
