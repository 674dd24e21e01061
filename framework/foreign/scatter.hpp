// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Elements of an array in any order into a channel of a capture.
#pragma once

#include "foreign/foreign_file.hpp"
#include "io/refused_lengths.hpp"

#include <cstdint>
#include <optional>
#include <span>

namespace tofgraph::foreign {

/// Axis of an array in memory: its size, and the step of the output per element, modulo 2^64 where it runs backwards.
struct AxisStep {
  std::uint64_t extent = 1, step = 0;
};

/// Conversion of a value.
struct Conversion {
  std::uint32_t type = TOFGRAPH_TYPE_F32;   ///< of the channel: F32, U16, I16, I32
  double scale = 1, zero = 0;               ///< (value - zero) scale; F32 only has a scale
  std::optional<std::uint64_t> mask;        ///< bits that count, of integers
  std::uint32_t signed_bits = 0;            ///< lowest bits that are a number in two's complement; 0: all, as they are
  std::uint64_t first = 0;                  ///< element of the output that the first of the input becomes
  std::span<const double> invalid;          ///< values that mean "no measurement"
  bool is_length = false;                   ///< zero and negative values mean it as well
  io::RefusedLengths* refused = nullptr;    ///< counts such lengths, null: not; those of `invalid` do not count
  std::uint64_t pixels = 0, per_pixel = 1;  ///< of the image; elements of a pixel, which stand together
};

/// Converts one frame. Invalid elements become NaN, in integer channels 0, and their pixel is flagged.
/// @param in elements in the array's order @param steps of its axes, the slowest first
/// @throws ForeignError a value that the channel cannot hold
void scatter(const FileArray& array, const std::uint8_t* in, std::span<const AxisStep> steps,
             const Conversion& conversion, void* out, std::uint16_t* flags);

/// Points of which a coordinate is not finite, or which are the origin, become NaN and flagged. @param refused counts
/// those at the origin and those too far away
void mark_invalid_points(float* points, std::uint16_t* flags, std::uint64_t pixels, io::RefusedLengths& refused);

}  // namespace tofgraph::foreign
