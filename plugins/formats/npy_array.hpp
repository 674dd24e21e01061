// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file NumPy arrays as arrays of a file format.
#pragma once

#include <tofgraph/format.hpp>

#include <algorithm>
#include <string>

#include "io/npy.hpp"

namespace tofgraph {

/// @param stored size of the elements in bytes @throws std::runtime_error if it differs from the header's
inline FileArray npy_array(const io::NpyHeader& header, const std::string& name, std::uint64_t stored) {
  FileArray array;
  array.kind = header.kind == 'f'   ? TOFGRAPH_ELEMENT_FLOAT
               : header.kind == 'i' ? TOFGRAPH_ELEMENT_SIGNED
                                    : TOFGRAPH_ELEMENT_UNSIGNED;
  array.bytes = static_cast<std::uint32_t>(header.bytes);
  array.extent = header.shape;
  if (array.extent.empty()) array.extent = {1};
  if (array.extent.size() > 6) throw std::runtime_error("has an array of more than six dimensions");
  std::uint64_t announced = header.bytes;
  for (const std::uint64_t e : array.extent) {
    if (e != 0 && announced > (std::uint64_t{1} << 50U) / e) throw std::runtime_error("announces an impossible size");
    announced *= e;
  }
  if (announced != stored)
    throw std::runtime_error("announces " + std::to_string(announced) + " bytes of values, but has " +
                             std::to_string(stored) +
                             (stored < announced ? ": it was cut off" : ": something was appended to it"));
  array.name = name;
  array.text = "NumPy";
  array.reversed = header.by_columns && array.extent.size() > 1;
  if (array.reversed) std::ranges::reverse(array.extent);
  return array;
}

/// Converts elements to the byte order of this machine. @param bytes of all elements
inline void to_native(const io::NpyHeader& header, void* values, std::uint64_t bytes) {
  if (!header.other_order() || header.bytes == 1) return;
  auto* first = static_cast<std::uint8_t*>(values);
  for (std::uint64_t at = 0; at < bytes; at += header.bytes) std::reverse(first + at, first + at + header.bytes);
}

}  // namespace tofgraph
