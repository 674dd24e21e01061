// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The arrays of a capture with one value for each frame. For this folder only; the lock is held by the caller.
#pragma once

#include "io/captures/capture_layout.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace tofgraph::io::h5 {

struct MetadataArray {
  const layout::Metadata* kind;
  std::vector<layout::Element> values;

  /// True where the values of these frames are all known.
  bool knows(std::size_t first, std::size_t last) const;
};

/// The kind of an array; null: no array has this name.
const layout::Metadata* metadata_kind(const std::string& name);

/// Reads what is left of an array in a file that was cut off after `end` bytes; the values of the other frames are
/// unknown, their device numbers are their places.
MetadataArray read_cut_array(hid_t group, const layout::Metadata& kind, std::size_t frames, std::uint64_t end);

}  // namespace tofgraph::io::h5
