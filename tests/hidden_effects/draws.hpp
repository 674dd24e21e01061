// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Random numbers of a campaign: one generator per purpose, so that an additional draw changes no other.
#pragma once

#include <cstdint>
#include <random>

namespace tofgraph::hidden {

enum Purpose : std::uint64_t { camera_draw = 1, order_draw, maps_draw, drift_draw, bad_pixels_draw, condition_draw };

inline std::mt19937_64 generator(std::uint64_t seed, std::uint64_t purpose) {
  std::seed_seq sequence{seed, seed >> 32, purpose};
  return std::mt19937_64(sequence);
}

}  // namespace tofgraph::hidden
