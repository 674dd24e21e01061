// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "foreign/readings.hpp"

#include "config/quantity.hpp"

#include <tofgraph/array.hpp>
#include <tofgraph/channels.hpp>
#include <tofgraph/physics/exposures.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace tofgraph::foreign {
namespace {

bool fits(Axis axis, std::uint64_t extent, const tofgraph_camera* camera) {
  switch (axis) {
    case Axis::frame:
      return true;
    case Axis::exposure:
      return camera == nullptr || extent == physics::exposures_of(*camera).size();
    case Axis::tap:
      return extent == 2;
    case Axis::row:
      return camera == nullptr || extent == camera->height;
    case Axis::column:
      return camera == nullptr || extent == camera->width;
    case Axis::coordinate:
      return extent == 3;
    case Axis::point:
      return true;
  }
  return false;
}

/// Number of occurrences of each word of a type; a table for more than two bytes would be larger than any image.
template <class T> std::vector<std::uint32_t> counts_of(const std::vector<std::uint8_t>& bytes) {
  std::vector<std::uint32_t> counts(std::size_t{std::numeric_limits<T>::max()} + 1);
  for (std::size_t i = 0; i + sizeof(T) <= bytes.size(); i += sizeof(T)) {
    T word;
    std::memcpy(&word, &bytes[i], sizeof word);
    ++counts[word];
  }
  return counts;
}

/// Calls visit(bits of an element, number of elements with these bits) for an array of integers.
template <class Visit> void each_word(const FileArray& array, const std::vector<std::uint8_t>& bytes, Visit&& visit) {
  if (array.bytes <= 2) {
    const auto counts = array.bytes == 1 ? counts_of<std::uint8_t>(bytes) : counts_of<std::uint16_t>(bytes);
    for (std::size_t word = 0; word < counts.size(); ++word)
      if (counts[word] != 0) visit(word, std::size_t{counts[word]});
    return;
  }
  for (std::size_t i = 0; i + array.bytes <= bytes.size(); i += array.bytes) {
    std::uint64_t word = 0;
    std::memcpy(&word, &bytes[i], array.bytes);
    visit(word, std::size_t{1});
  }
}

/// Smallest and largest value that an array can hold. @param signed_bits as in ChannelLayout
std::pair<double, double> limits_of(const FileArray& array, std::uint32_t signed_bits = 0) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  if (array.kind == TOFGRAPH_ELEMENT_FLOAT) return {-infinity, infinity};
  const bool is_signed = signed_bits != 0 || array.kind == TOFGRAPH_ELEMENT_SIGNED;
  const auto bits = static_cast<int>(signed_bits != 0 ? signed_bits : 8 * array.bytes);
  const double end = std::ldexp(1.0, bits - (is_signed ? 1 : 0));
  return {is_signed ? -end : 0, end - 1};
}

}  // namespace

double scale_of(const std::string& unit, const std::string& wanted, const std::string& where) {
  const config::Quantity one = config::parse_scale(unit, wanted);
  if (!one.ok() || !(one.value > 0))
    throw ForeignError(fmt::format("{}: '{}' is not a unit of {}; example: unit: {}{}", where, unit, wanted,
                                   wanted == "m" ? "mm" : wanted, wanted == "m" ? ", as an option --unit mm" : ""));
  return one.value;
}

bool is_scattered(const std::vector<Axis>& axes) { return std::ranges::find(axes, Axis::point) != axes.end(); }

std::vector<Axis> axes_of_channel(std::string_view channel, bool scattered) {
  std::vector<Axis> axes = {Axis::row, Axis::column};
  if (scattered) axes = {Axis::point};
  if (channel == "taps") axes.insert(axes.begin(), {Axis::exposure, Axis::tap});
  if (channel == "phases") axes.insert(axes.begin(), Axis::exposure);
  if (channel == "points") axes.push_back(Axis::coordinate);
  return axes;
}

std::vector<std::vector<Axis>> possible_axes(const std::vector<std::uint64_t>& shape, std::string_view channel,
                                             const tofgraph_camera* camera, bool scattered) {
  std::vector<Axis> axes = axes_of_channel(channel, scattered);
  if (shape.size() == axes.size() + 1) axes.push_back(Axis::frame);
  std::vector<std::vector<Axis>> possible;
  if (shape.size() != axes.size()) return possible;
  std::ranges::sort(axes);
  do {
    bool all = true;
    for (std::size_t i = 0; i < axes.size(); ++i) all = all && fits(axes[i], shape[i], camera);
    if (all) possible.push_back(axes);
  } while (std::ranges::next_permutation(axes).found);
  return possible;
}

std::vector<double> numbers_of(const FileArray& array, const std::vector<std::uint8_t>& bytes) {
  std::vector<double> values;
  with_element({array.kind, array.bytes}, [&](auto value) {
    for (std::size_t i = 0; i + sizeof value <= bytes.size(); i += sizeof value) {
      std::memcpy(&value, &bytes[i], sizeof value);
      values.push_back(static_cast<double>(value));
    }
  });
  return values;
}

double number_in(std::uint64_t word, std::uint32_t kind, std::uint32_t bytes, const ChannelLayout& layout) {
  if (layout.mask) word &= *layout.mask;
  const std::uint32_t width = layout.signed_bits != 0 ? layout.signed_bits : 8 * bytes;
  const std::uint64_t sign = std::uint64_t{1} << (width - 1), bits = word & (2 * sign - 1);
  if (layout.signed_bits == 0 && kind != TOFGRAPH_ELEMENT_SIGNED) return static_cast<double>(bits);
  return static_cast<double>(static_cast<std::int64_t>((bits ^ sign) - sign));
}

namespace {

/// Values of a channel without its codes for "no measurement".
std::vector<io::CountedValue> measurements_of(const FileArray& array, const std::vector<std::uint8_t>& bytes,
                                              const ChannelLayout& layout) {
  const auto is_stated = [&](double v) { return std::ranges::binary_search(layout.invalid, v); };
  std::vector<io::CountedValue> values;
  if (array.kind == TOFGRAPH_ELEMENT_FLOAT) {
    for (const double value : foreign::numbers_of(array, bytes))
      if (!is_stated(value)) values.push_back({value, 1});
    return values;
  }
  const ChannelLayout stored{.signed_bits = layout.signed_bits};
  each_word(array, bytes, [&](std::uint64_t word, std::size_t count) {
    const double value = number_in(word, array.kind, array.bytes, layout);
    if (!is_stated(value) && !is_stated(number_in(word, array.kind, array.bytes, stored)))
      values.push_back({value, count});
  });
  return values;
}

}  // namespace

std::vector<io::CountedValue> suspected_codes_of(const FileArray& array, const std::vector<std::uint8_t>& bytes,
                                                 const ChannelLayout& layout) {
  std::vector<io::CountedValue> values = measurements_of(array, bytes, layout);
  if (array.kind == TOFGRAPH_ELEMENT_FLOAT)
    return io::suspected_codes(std::move(values), std::numeric_limits<double>::infinity());
  const bool is_signed = layout.signed_bits != 0 || array.kind == TOFGRAPH_ELEMENT_SIGNED;
  const std::uint32_t width = layout.signed_bits != 0 ? layout.signed_bits : 8 * array.bytes;
  const std::uint64_t largest = ~std::uint64_t{0} >> (64 - width + (is_signed ? 1 : 0));
  // Negative lengths are refused in any case.
  const double smallest =
      is_signed && !is_length_channel(layout.channel) ? -std::ldexp(1.0, static_cast<int>(width) - 1) : 0;
  return io::suspected_codes(std::move(values), number_in(largest, array.kind, array.bytes, layout), smallest);
}

ValueRange range_of(const ForeignFile& file, std::size_t index, const ChannelLayout& layout) {
  const FileArray& array = file.arrays()[index];
  ValueRange range;
  if (array.elements() == 0) return range;
  constexpr std::uint64_t max_bytes = std::uint64_t{1} << 28U;  // read at most for a message
  const bool one_image = array.extent.size() <= 2 && array.elements() * array.bytes <= max_bytes;
  const std::uint64_t count = one_image ? array.extent[0] : 1;
  if (array.elements() / array.extent[0] * count * array.bytes > max_bytes) return range;
  std::vector<std::uint8_t> bytes(array.elements() / array.extent[0] * count * array.bytes);
  file.read(index, 0, count, bytes.data());
  std::vector<io::CountedValue> values;
  if (array.kind == TOFGRAPH_ELEMENT_FLOAT)
    for (const double value : numbers_of(array, bytes)) values.push_back({value, 1});
  else
    each_word(array, bytes, [&](std::uint64_t word, std::size_t count) {
      range.bits |= word;
      values.push_back({number_in(word, array.kind, array.bytes, layout), count});
    });
  const double elements = static_cast<double>(bytes.size()) / array.bytes;
  range.minimum = std::numeric_limits<double>::infinity(), range.maximum = -range.minimum;
  for (const auto& [value, count] : values) {
    const double share = static_cast<double>(count) / elements;
    range.zeros += value == 0 ? share : 0;
    range.negative += std::isfinite(value) && value < 0 ? share : 0;
    range.no_numbers += std::isfinite(value) ? 0 : share;
    if (!std::isfinite(value)) continue;
    range.minimum = std::min(range.minimum, value);
    range.maximum = std::max(range.maximum, value);
  }
  range.codes = suspected_codes_of(array, bytes, layout);
  std::vector<double> positive;
  for (const auto& [value, count] : measurements_of(array, bytes, layout))
    if (value > 0 && std::isfinite(value) &&
        std::ranges::find(range.codes, value, &io::CountedValue::value) == range.codes.end())
      positive.insert(positive.end(), count, value);
  std::ranges::sort(positive);
  range.found = !positive.empty();
  if (!range.found) return range;
  range.low = positive[positive.size() / 100];
  range.high = positive[positive.size() - 1 - positive.size() / 100];
  return range;
}

std::vector<std::string> unit_readings(const ValueRange& range) {
  std::vector<std::string> lines;
  static constexpr std::pair<const char*, double> units[] = {{"m", 1}, {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}};
  for (const auto& [unit, scale] : units)
    lines.push_back(fmt::format("unit: {:<4} {} to {}", unit, config::format_quantity(range.low * scale, "m"),
                                config::format_quantity(range.high * scale, "m")));
  return lines;
}

std::vector<std::string> channel_readings() {
  return {"depth      along the optical axis from the sensor plane: flat boards are flat",
          "range      straight from the lens centre: flat boards bulge away from the middle",
          "distance   half of the light's path from sources to board to pixel", "amplitude  of the modulated light",
          "intensity  of all light"};
}

std::string readings_text(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += "\n           " + line;
  return text;
}

std::string unit_of(std::string_view channel) {
  if (is_length_channel(channel) || channel == "sigma") return "m";
  return channel == "flags" ? "" : "counts";
}

void check_layout(const ForeignFile& file, const FileArray& array, const ChannelLayout& layout) {
  const auto refuse = [&](const std::string& what) {
    throw ForeignError(fmt::format("{}: '{}': {}", file.path().string(), layout.channel, what));
  };
  if (array.elements() == 0) refuse("the array is empty");
  if (layout.signed_bits > 8 * array.bytes || (layout.signed_bits != 0 && array.kind == TOFGRAPH_ELEMENT_FLOAT))
    refuse(fmt::format("has signed_bits: {}, but its values are {}", layout.signed_bits, element_text(array)));
  for (const StatusBits& status : layout.status) {
    if (array.kind == TOFGRAPH_ELEMENT_FLOAT || (array.bytes < 8 && status.bits >> (8 * array.bytes) != 0))
      refuse(fmt::format("has the status bits {:#x}, but its values are {}", status.bits, element_text(array)));
  }
  if (layout.mask && array.kind == TOFGRAPH_ELEMENT_FLOAT)
    refuse("has a mask, which applies to integers only, but its values are floating-point numbers");
  const auto [low, high] = limits_of(array, layout.signed_bits);
  for (const double code : layout.invalid) {
    if (code >= low && code <= high && (array.kind == TOFGRAPH_ELEMENT_FLOAT || code == std::floor(code))) continue;
    refuse(fmt::format("has invalid: {}, but its values are {}{}, {} to {}", code,
                       layout.signed_bits != 0 ? fmt::format("the lowest {} bits of ", layout.signed_bits) : "",
                       element_text(array), low, high));
  }
  if (!layout.unit.empty() && unit_of(layout.channel) != "m")
    refuse(fmt::format("has the unit '{}', but is not a length: values stay as they are", layout.unit));
}

std::vector<Axis> axes_of(const ForeignFile& file, std::size_t index, const ChannelLayout& layout,
                          const tofgraph_camera& camera) {
  const std::string where = file.path().string();
  const FileArray& array = file.arrays()[index];
  const std::string name = array.name.empty() ? std::string("the array") : "'" + array.name + "'";
  std::vector<std::uint64_t> shape = shape_of(array);
  std::vector<Axis> axes = layout.axes;
  if (axes.empty() && !array.axes.empty()) axes = parse_axes(array.axes).value_or(axes);
  const bool scattered = is_scattered(axes) && (layout.channel == "points" || unit_of(layout.channel) == "counts");
  const auto possible = possible_axes(shape, layout.channel, &camera, scattered);
  if (file.is_headerless() && axes.size() + 1 == shape.size()) axes.insert(axes.begin(), Axis::frame);
  if (axes.empty()) {
    if (possible.size() > 1) {
      std::vector<std::string> lines;
      for (const auto& one : possible) lines.push_back("axes: " + axes_text(one));
      throw ForeignError(
          fmt::format("{}: the order of the axes of {}, {}, is ambiguous for a camera of {} x {} "
                      "px\n         readings that are possible:{}\n         state one, e.g. --axes "
                      "\"{}\"",
                      where, name, shape_text(array), camera.width, camera.height, readings_text(lines),
                      axes_text(possible.front())));
    }
    if (possible.size() == 1) axes = possible.front();
  }
  if (std::ranges::find(possible, axes) == possible.end()) {
    std::vector<std::string> names;
    for (const Axis axis : axes_of_channel(layout.channel))
      names.emplace_back(axis_names[static_cast<std::size_t>(axis)]);
    throw ForeignError(fmt::format(
        "{}: {} is {}{}, which does not fit '{}' of a camera of {} x {} px ({} high, {} "
        "wide{})\n         its axes are {}, in any order, and perhaps frame",
        where, name, shape_text(array), axes.empty() ? "" : fmt::format(" with the axes {}", axes_text(axes)),
        layout.channel, camera.width, camera.height, camera.height, camera.width,
        layout.channel == "phases" || layout.channel == "taps"
            ? fmt::format(", {} exposures", physics::exposures_of(camera).size())
            : "",
        fmt::join(names, ", ")));
  }
  return axes;
}

void refuse_without_unit(const ForeignFile& file, std::size_t index, const std::string& channel) {
  const FileArray& array = file.arrays()[index];
  const ValueRange range = range_of(file, index);
  throw ForeignError(fmt::format(
      "{}: the unit of {} ('{}') is not stated\n         readings that are possible:{}\n         state one, "
      "e.g. --unit mm",
      file.path().string(), array.name.empty() ? "the array" : "'" + array.name + "'", channel,
      range.found ? readings_text(unit_readings(range)) : "\n           no value of the first frame is positive"));
}

}  // namespace tofgraph::foreign
