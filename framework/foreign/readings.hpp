// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Possible interpretations of an array if none is stated: axes, unit and channel.
#pragma once

#include "foreign/foreign_file.hpp"
#include "foreign/layout.hpp"
#include "io/codes.hpp"

#include <tofgraph/plugin.h>

namespace tofgraph::foreign {

/// Axis orders with which an array of this shape can be a channel of this camera.
/// @param camera null: any image size @param scattered unordered points instead of an image
std::vector<std::vector<Axis>> possible_axes(const std::vector<std::uint64_t>& shape, std::string_view channel,
                                             const tofgraph_camera* camera, bool scattered = false);
/// Axes of a channel of this name, without `frame`. @param scattered unordered points instead of an image
std::vector<Axis> axes_of_channel(std::string_view channel, bool scattered = false);
/// Returns true if the axes are those of unordered points.
bool is_scattered(const std::vector<Axis>& axes);

/// Values of the first elements of an array.
struct ValueRange {
  double minimum = 0, maximum = 0;                 ///< of the finite elements
  double low = 0, high = 0;                        ///< contain the middle 98 % of the positive ones except codes
  double zeros = 0, negative = 0, no_numbers = 0;  ///< shares of the elements; no_numbers: NaN and infinite
  bool found = false;                              ///< some are positive
  std::vector<io::CountedValue> codes;
  std::uint64_t bits = 0;  ///< of integers, set in any element
};
/// Range of the first element along the slowest axis, or of a complete array of up to two axes.
/// @param layout of the channel that is read from the array; its codes are not suspected, its unused bits are ignored
ValueRange range_of(const ForeignFile& file, std::size_t array, const ChannelLayout& layout = {});
/// Converts the elements of an array to double.
std::vector<double> numbers_of(const FileArray& array, const std::vector<std::uint8_t>& bytes);
/// Number in the bits of an integer element: those of the mask, in two's complement if the type is signed or the layout
/// has signed_bits. @param kind, bytes as in tofgraph_file_array
double number_in(std::uint64_t word, std::uint32_t kind, std::uint32_t bytes, const ChannelLayout& layout);
/// Values of a channel, without codes for "no measurement", that are probably codes. @param bytes of the array
std::vector<io::CountedValue> suspected_codes_of(const FileArray& array, const std::vector<std::uint8_t>& bytes,
                                                 const ChannelLayout& layout);

/// SI value of one unit. @param where file name for messages @throws ForeignError for a unit of another dimension
double scale_of(const std::string& unit, const std::string& wanted, const std::string& where);
/// Unit of a channel in captures: m, counts or none.
std::string unit_of(std::string_view channel);
/// Checks the settings of a channel. @throws ForeignError if they do not apply to its array
void check_layout(const ForeignFile& file, const FileArray& array, const ChannelLayout& layout);

/// Axes of the array of a channel in the order of its shape: those stated, those of the format, or the only possible
/// ones. @throws ForeignError listing the possible orders
std::vector<Axis> axes_of(const ForeignFile& file, std::size_t array, const ChannelLayout& layout,
                          const tofgraph_camera& camera);
/// @throws ForeignError because the unit of a length is not stated, with the range of lengths for each unit
[[noreturn]] void refuse_without_unit(const ForeignFile& file, std::size_t array, const std::string& channel);

/// Lines with the range of lengths for each unit: "unit: mm   0.35 m to 2.1 m".
std::vector<std::string> unit_readings(const ValueRange& range);
/// Joins lines of a message, each on a line of its own.
std::string readings_text(const std::vector<std::string>& lines);
/// Lines with the channels that an array may contain.
std::vector<std::string> channel_readings();

}  // namespace tofgraph::foreign
