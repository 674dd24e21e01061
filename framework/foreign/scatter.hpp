// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Conversion of array elements in any axis order into a channel of a capture.
#pragma once

#include "foreign/foreign_file.hpp"
#include "foreign/layout.hpp"
#include "io/refused_lengths.hpp"

#include <cstdint>
#include <optional>
#include <span>

namespace tofgraph::foreign {

/// Axis of an array in memory: size, and step in the output per element, modulo 2^64 for a reversed axis.
struct AxisStep {
  std::uint64_t extent = 1, step = 0;
};

/// Words with bits that neither belong to the value nor are stated as status bits.
struct DroppedBits {
  std::uint64_t bits = 0;  ///< all bits that were set
  std::uint64_t count = 0, words = 0;
};

/// Conversion of values.
struct Conversion {
  std::uint32_t type = TOFGRAPH_TYPE_F32;   ///< of the channel: F32, U16, I16, I32
  double scale = 1, zero = 0;               ///< (value - zero) scale; the scale is used for F32 only
  std::optional<std::uint64_t> mask;        ///< used bits of integers
  std::uint32_t signed_bits = 0;            ///< lowest bits, a number in two's complement; 0: all, by the type
  std::uint64_t first = 0;                  ///< index in the output of the first input element
  std::span<const StatusBits> status;       ///< set flags
  std::span<const double> invalid;          ///< "no measurement", before or after the mask; ascending
  bool is_length = false;                   ///< values outside (0, max_length] are invalid
  io::RefusedLengths* refused = nullptr;    ///< counts such lengths except those in `invalid`; may be null
  DroppedBits* dropped = nullptr;           ///< counts bits that are dropped by the mask; may be null
  std::uint64_t pixels = 0, per_pixel = 1;  ///< per image; contiguous elements per pixel
};

/// Converts one frame. Invalid elements become NaN, or 0 in integer channels, and their pixels are flagged.
/// @param in elements in the order of the array @param steps of its axes, the slowest first
/// @throws ForeignError if a value does not fit into the type of the channel
void scatter(const FileArray& array, const std::uint8_t* in, std::span<const AxisStep> steps,
             const Conversion& conversion, void* out, std::uint16_t* flags);

/// Sets points with a coordinate that is not finite, at the origin or too far away to NaN and flags them.
/// @param refused counts those at the origin and those too far away
void mark_invalid_points(float* points, std::uint16_t* flags, std::uint64_t pixels, io::RefusedLengths& refused);

}  // namespace tofgraph::foreign
