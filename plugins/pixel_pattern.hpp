// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Pixel pattern of which only the spread is known: random, normal, independent from pixel to pixel.
#pragma once

#include <tofgraph/effect.hpp>
#include <tofgraph/physics/random.hpp>

#include <array>
#include <cmath>

namespace tofgraph {

/// Two independent standard normal numbers for the pixel at point i, always the same for the same seed, and independent
/// of the noise of frames with that seed. Zero if the points are not the pixels but represent many of them, over which
/// such a pattern averages out.
inline std::array<double, 2> drawn_pattern(const LightState& light, std::size_t i, std::int64_t seed) {
  if (light.state.spacing != 1) return {0, 0};
  const auto column = static_cast<std::uint32_t>(std::lround(std::max(light.state.pixel[2 * i], 0.0)));
  const auto row = static_cast<std::uint32_t>(std::lround(std::max(light.state.pixel[2 * i + 1], 0.0)));
  const auto numbers = physics::normal_numbers(static_cast<std::uint64_t>(seed), 0, row * light.camera().width + column,
                                               physics::pattern_stream);
  return {numbers[0], numbers[1]};
}

}  // namespace tofgraph
