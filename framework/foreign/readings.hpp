// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Readings of an array that are possible where nobody stated one: which axes, which unit, which channel.
#pragma once

#include "foreign/foreign_file.hpp"
#include "foreign/layout.hpp"

#include <tofgraph/plugin.h>

namespace tofgraph::foreign {

/// Orders of the axes in which an array of this shape can be a channel of this camera.
/// @param camera null: of any size @param scattered of points in no order, instead of an image
std::vector<std::vector<Axis>> possible_axes(const std::vector<std::uint64_t>& shape, std::string_view channel,
                                             const tofgraph_camera* camera, bool scattered = false);
/// Axes that a channel of this name has beside `frame`. @param scattered of points in no order, instead of an image
std::vector<Axis> axes_of_channel(std::string_view channel, bool scattered = false);
/// Returns whether the axes are those of points in no order.
bool is_scattered(const std::vector<Axis>& axes);

/// Smallest and largest value of the first elements of an array that are finite, positive and not the type's largest.
struct ValueRange {
  double low = 0, high = 0;
  double zeros = 0, negative = 0, no_numbers = 0;  ///< shares of the elements; no number: NaN and infinities
  bool found = false;
};
/// @param count of the slowest axis, at most; an array of two axes, one image, is looked at as a whole
ValueRange range_of(const ForeignFile& file, std::size_t array, std::uint64_t count = 1);
/// Elements of an array as double.
std::vector<double> numbers_of(const FileArray& array, const std::vector<std::uint8_t>& bytes);

/// SI value of one unit. @param where names the file @throws ForeignError a unit of another dimension
double scale_of(const std::string& unit, const std::string& wanted, const std::string& where);
/// Unit of a channel in captures: m, counts or none.
std::string unit_of(std::string_view channel);
/// Checks the settings of a channel. @throws ForeignError those that its array cannot have
void check_layout(const ForeignFile& file, const FileArray& array, const ChannelLayout& layout);

/// The stated axes of a channel's array, those of its format, or the only ones that are possible; in the order of its
/// shape. @throws ForeignError with the orders that are possible
std::vector<Axis> axes_of(const ForeignFile& file, std::size_t array, const ChannelLayout& layout,
                          const tofgraph_camera& camera);
/// @throws ForeignError that nothing states the unit of a length, with what each unit would mean
[[noreturn]] void refuse_without_unit(const ForeignFile& file, std::size_t array, const std::string& channel);

/// Lines that show what each unit would mean for lengths: "unit: mm   0.35 m to 2.1 m".
std::vector<std::string> unit_readings(const ValueRange& range);
/// Lines of a message, each in a line of its own.
std::string readings_text(const std::vector<std::string>& lines);
/// Lines that show what the array could be.
std::vector<std::string> channel_readings();

}  // namespace tofgraph::foreign
