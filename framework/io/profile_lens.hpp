// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Lens part of a camera profile.
#pragma once

#include "config/document.hpp"
#include "config/quantity.hpp"

#include <tofgraph/plugin.h>

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <vector>

namespace tofgraph::io {

/// Position of a key's value; that of the document if the key is missing.
inline config::Position place_of(const config::Value& document, std::string_view key) {
  const config::Entry* entry = document.find(key);
  return entry != nullptr ? entry->value.at : document.at;
}

/// Reads one value for both axes, or [x, y].
inline void read_pair(const config::Entry& entry, std::string_view unit, std::string_view example, double* pair,
                      config::Diagnostics& diagnostics) {
  const bool both = entry.value.is_list() && entry.value.items.size() == 2;
  for (std::size_t i = 0; i < 2; ++i) {
    const config::Value& value = both ? entry.value.items[i] : entry.value;
    const auto parsed = config::parse_quantity(value.text, unit);
    pair[i] = parsed.value;
    if (value.is_scalar() && parsed.ok() && parsed.value > 0) continue;
    const std::string problem = parsed.ok() ? "must be positive" : parsed.problem;
    diagnostics.error(value.at, fmt::format("'{}' is {}: {}", entry.key, value.described(), problem),
                      fmt::format("example: {}: {}", entry.key, example));
    if (!both) return;
  }
}

/// Reads pixel_pitch, focal_length, principal_point, lens, distortion, skew and rays.
/// @param rays out: height x width x 3 if the lens is a table; otherwise it remains empty
void read_lens(config::Reader& reader, tofgraph_camera& camera, const config::Value& document, std::vector<float>& rays,
               config::Diagnostics& diagnostics);

}  // namespace tofgraph::io
