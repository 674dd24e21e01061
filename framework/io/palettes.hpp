// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Colours of all pictures, so that a value has the same colour everywhere.
#pragma once

#include <tofgraph/channels.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tofgraph::io {

/// 0xRRGGBB
using Colour = std::uint32_t;

/// From small (dark) to large (bright), in even steps; for lengths, near is dark. Viridis: perceptually uniform.
inline constexpr std::array<Colour, 52> rising_colours = {
    0x440154, 0x46085c, 0x471063, 0x481769, 0x481d6f, 0x482475, 0x472a7a, 0x46307e, 0x453781, 0x433d84, 0x414287,
    0x3f4889, 0x3d4e8a, 0x3a538b, 0x38598c, 0x355e8d, 0x33638d, 0x31688e, 0x2e6d8e, 0x2c718e, 0x2a768e, 0x297b8e,
    0x27808e, 0x25848e, 0x23898e, 0x218e8d, 0x20928c, 0x1f978b, 0x1e9c89, 0x1fa188, 0x21a585, 0x24aa83, 0x28ae80,
    0x2eb37c, 0x35b779, 0x3dbc74, 0x46c06f, 0x50c46a, 0x5ac864, 0x65cb5e, 0x70cf57, 0x7cd250, 0x89d548, 0x95d840,
    0xa2da37, 0xb0dd2f, 0xbddf26, 0xcae11f, 0xd8e219, 0xe5e419, 0xf1e51d, 0xfde725};
/// Diverging: from negative over 0 to positive.
inline constexpr std::array<Colour, 5> signed_colours = {0x2166ac, 0x92c5de, 0xf7f7f7, 0xf4a582, 0xb2182b};
/// Colours of successive lines.
inline constexpr std::array<Colour, 6> line_colours = {0x1f4e9c, 0xc0392b, 0x2a8c4a, 0x8e44ad, 0xd68910, 0x555555};
/// Colour of missing values.
inline constexpr Colour invalid_colour = 0xaaaaaa;

/// Bit of the channel `flags`.
struct FlagColour {
  std::uint16_t bit;
  const char* name;
  Colour colour;
};
inline constexpr std::array<FlagColour, 11> flag_colours = {{{flag::invalid, "invalid", invalid_colour},
                                                             {flag::saturated, "saturated", 0xd62728},
                                                             {flag::inconsistent, "inconsistent", 0x9467bd},
                                                             {flag::low_signal, "low signal", 0x1f4e9c},
                                                             {flag::wrapped, "wrapped", 0x17becf},
                                                             {flag::mixed, "mixed", 0xff7f0e},
                                                             {flag::outside_lens, "outside lens", 0x8c564b},
                                                             {flag::user, "user", 0xf7a1d4},
                                                             {flag::extrapolated, "extrapolated", 0xbcbd22},
                                                             {flag::filled, "filled", 0x2ca02c},
                                                             {flag::bad_pixel, "bad pixel", 0x202020}}};
/// Colours of a pixel without flags and of a bit without a name.
inline constexpr Colour no_flag_colour = 0xf2f2f2, other_flag_colour = 0x6b6b6b;

/// Colour at a position from 0 to 1 between even steps.
inline Colour colour_at(std::span<const Colour> steps, double share) {
  const double place = (std::isnan(share) ? 0 : std::clamp(share, 0.0, 1.0)) * static_cast<double>(steps.size() - 1);
  const std::size_t first = std::min(static_cast<std::size_t>(place), steps.size() - 2);
  Colour result = 0;
  for (const unsigned shift : {16U, 8U, 0U}) {
    const auto part = [&](std::size_t i) { return static_cast<double>(steps[i] >> shift & 0xffU); };
    const double mixed = std::lerp(part(first), part(first + 1), place - static_cast<double>(first));
    result |= static_cast<Colour>(std::lround(mixed)) << shift;
  }
  return result;
}

}  // namespace tofgraph::io
