// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Arrays of a capture with one value per frame. Internal to this folder; the caller holds the lock.
#pragma once

#include "io/captures/capture_layout.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace tofgraph::io::h5 {

struct MetadataArray {
  const layout::Metadata* kind;
  std::vector<layout::Element> values;

  /// True if the values of all these frames are known.
  bool knows(std::size_t first, std::size_t last) const;
};

/// Kind of an array; null: no array has this name.
const layout::Metadata* metadata_kind(const std::string& name);

/// Reads the available part of an array in a file that was truncated to `end` bytes; values of the other frames are
/// unknown, their device numbers are set to their indices.
MetadataArray read_cut_array(hid_t group, const layout::Metadata& kind, std::size_t frames, std::uint64_t end);

}  // namespace tofgraph::io::h5
