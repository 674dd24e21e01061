// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Counter-based random numbers: the same numbers for the same (seed, frame, pixel), independent of call order and
/// thread. Philox4x32-10 of Salmon, Moraes, Dror, Shaw: Parallel random numbers: as easy as 1, 2, 3 (SC 2011).
#pragma once

#include <tofgraph/physics/constants.hpp>

#include <array>
#include <cmath>
#include <cstdint>

namespace tofgraph::physics {

using RandomWords = std::array<std::uint32_t, 4>;

/// Streams of normal_numbers() for uses outside the simulator, whose frames have the streams below 2^31: numbers of
/// different streams are independent, also for the same seed.
inline constexpr std::uint32_t pattern_stream = 1U << 31U, added_noise_stream = pattern_stream + 1;

/// Four random words for a counter under a key.
constexpr RandomWords philox(RandomWords counter, std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t first = std::uint64_t{0xD2511F53U} * counter[0];
    const std::uint64_t second = std::uint64_t{0xCD9E8D57U} * counter[2];
    counter = {static_cast<std::uint32_t>(second >> 32U) ^ counter[1] ^ key[0], static_cast<std::uint32_t>(second),
               static_cast<std::uint32_t>(first >> 32U) ^ counter[3] ^ key[1], static_cast<std::uint32_t>(first)};
    key = {key[0] + 0x9E3779B9U, key[1] + 0xBB67AE85U};
  }
  return counter;
}

/// Four independent standard normal numbers for one pixel of one frame (Box and Muller).
/// @param stream distinguishes uses within a frame
inline std::array<double, 4> normal_numbers(std::uint64_t seed, std::uint64_t frame, std::uint32_t pixel,
                                            std::uint32_t stream = 0) {
  const RandomWords words =
      philox({pixel, static_cast<std::uint32_t>(frame), static_cast<std::uint32_t>(frame >> 32U), stream},
             {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32U)});
  const auto uniform = [&words](std::size_t i) { return (words[i] + 0.5) * 0x1p-32; };  // 0 < u < 1
  const double radius0 = std::sqrt(-2 * std::log(uniform(0))), angle0 = two_pi * uniform(1);
  const double radius1 = std::sqrt(-2 * std::log(uniform(2))), angle1 = two_pi * uniform(3);
  return {radius0 * std::cos(angle0), radius0 * std::sin(angle0), radius1 * std::cos(angle1),
          radius1 * std::sin(angle1)};
}

}  // namespace tofgraph::physics
