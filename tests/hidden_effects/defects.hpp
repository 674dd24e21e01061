// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Bad pixels of a camera: 30 % of them are dead, 30 % hot, 40 % noisy.
#pragma once

#include "tests/hidden_effects/plain_camera.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace tofgraph::hidden {

/// Permanent defect of a pixel.
enum class Defect { none, dead, hot, noisy };

/// Defects, one entry per pixel. @param share of bad pixels
std::vector<Defect> draw_defects(const Camera& camera, std::uint64_t seed, double share = 0.05);

/// Counts of a tap as delivered by a defective pixel.
double damaged(Defect defect, double tap, std::mt19937_64& random);

inline std::uint16_t counts(double tap) {
  return static_cast<std::uint16_t>(std::lround(std::clamp(tap, 0.0, 65535.0)));
}

}  // namespace tofgraph::hidden
