// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Range of depths and reflectivities in which pixels are looked up in an offset table.
#pragma once

#include <tofgraph/physics/offset_table.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace tofgraph {

/// Range of the samples of an offset table with a margin, because the pixels of the outermost boards are noisy.
struct OffsetRange {
  /// Relative margin of depth and time; 5 times as much below the reflectivities, 6 times above.
  static constexpr double beyond = 0.05;
  double first = 1e9, last = 0;      ///< m
  double dark = 1e9, bright = 1e-9;  ///< reflectivities

  /// @param target whose samples count; none: all
  explicit OffsetRange(const physics::OffsetTable& table, std::optional<std::size_t> target = std::nullopt) {
    for (const physics::OffsetSample& s : table.samples()) {
      if (target && s.target != *target) continue;
      first = std::min(first, s.depth);
      last = std::max(last, s.depth);
      dark = std::fmin(dark, s.reflectivity);
      bright = std::fmax(bright, s.reflectivity);
    }
    first *= 1 - beyond;
    last *= 1 + beyond;
    dark *= 1 - 5 * beyond;
    bright *= 1 + 6 * beyond;
  }
};

/// Bits of a positive number, whose exponent and leading digits grow like a logarithm.
inline std::int32_t bits_of(float value) { return std::bit_cast<std::int32_t>(value); }

}  // namespace tofgraph
