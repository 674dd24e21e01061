// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "foreign/layout.hpp"

#include "config/quantity.hpp"
#include "io/unknown.hpp"

#include <tofgraph/format.h>
#include <tofgraph/channels.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

namespace tofgraph::foreign {
namespace {

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  for (std::size_t at = 0; (at = text.find_first_not_of(", []", at)) != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(", []", at), text.size());
    words.push_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

/// Joins the items of a list with blanks; a text is returned unchanged.
std::string joined(const config::Value& value) {
  if (!value.is_list()) return value.text;
  std::string text;
  for (const config::Value& item : value.items) text += (text.empty() ? "" : " ") + item.text;
  return text;
}

/// Parses a whole number, decimal or hexadecimal: 4095 or 0x0fff.
std::optional<std::uint64_t> whole_number(const std::string& text) {
  const bool hex = text.starts_with("0x");
  std::uint64_t bits = 0;
  const char *begin = text.data() + (hex ? 2 : 0), *end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(begin, end, bits, hex ? 16 : 10);
  return error == std::errc() && stop == end && begin != end ? std::optional(bits) : std::nullopt;
}

std::vector<double> numbers_of(const config::Entry& entry, config::Diagnostics& diagnostics) {
  std::vector<double> values;
  const std::vector<config::Value> items =
      entry.value.is_list() ? entry.value.items : std::vector<config::Value>{entry.value};
  for (const config::Value& item : items) {
    const config::Quantity number = config::parse_quantity(item.text, "");
    if (const auto bits = whole_number(item.text))
      values.push_back(static_cast<double>(*bits));
    else if (number.ok())
      values.push_back(number.value);
    else
      diagnostics.error(item.at, fmt::format("'{}' must be numbers, found {}", entry.key, item.described()),
                        fmt::format("example: {}: [0, 65535]", entry.key));
  }
  return values;
}

/// Keys of a channel that state status bits, named like the flags.
constexpr std::pair<const char*, std::uint16_t> status_keys[] = {
    {"saturated", flag::saturated},   {"inconsistent", flag::inconsistent},
    {"low_signal", flag::low_signal}, {"wrapped", flag::wrapped},
    {"mixed", flag::mixed},           {"bad_pixel", flag::bad_pixel | flag::invalid},
    {"invalid_bits", flag::invalid}};

std::optional<std::uint64_t> read_bits(config::Reader& reader, const char* key, const char* example,
                                       config::Diagnostics& diagnostics) {
  const config::Entry* entry = reader.take(key);
  if (entry == nullptr) return std::nullopt;
  const auto bits = whole_number(entry->value.text);
  if (!bits || *bits == 0)
    diagnostics.error(entry->value.at,
                      fmt::format("'{}' must be the bits of a whole number, found {}", key, entry->value.described()),
                      fmt::format("example: {}: {}", key, example));
  return bits;
}

ChannelLayout read_channel(const config::Entry& entry, config::Diagnostics& diagnostics) {
  ChannelLayout channel{.channel = entry.key};
  const std::vector<std::string> known(std::begin(layout_channels), std::end(layout_channels));
  if (std::ranges::find(known, entry.key) == known.end())
    diagnostics.error(entry.at, fmt::format("there is no channel '{}'", entry.key),
                      config::suggestion(entry.key, known, "channels"));
  config::Reader reader(entry.value, diagnostics, fmt::format("channel '{}'", entry.key));
  channel.array = reader.word("array", "");
  channel.unit = reader.word("unit", "");
  if (const config::Entry* axes = reader.take("axes")) {
    const auto parsed = parse_axes(joined(axes->value));
    if (parsed)
      channel.axes = *parsed;
    else
      diagnostics.error(axes->value.at,
                        fmt::format("'axes' has an unknown name, or one twice: '{}'", joined(axes->value)),
                        fmt::format("names: {}; example: axes: frame row column", fmt::join(axis_names, ", ")));
  }
  if (const config::Entry* invalid = reader.take("invalid")) channel.invalid = numbers_of(*invalid, diagnostics);
  std::ranges::sort(channel.invalid);
  channel.mask = read_bits(reader, "mask", "0x0fff", diagnostics);
  std::uint64_t status = 0;
  for (const auto& [key, flags] : status_keys) {
    const auto bits = read_bits(reader, key, "0x8000", diagnostics);
    if (!bits) continue;
    channel.status.push_back({*bits, flags});
    status |= *bits;
    if (channel.mask && (*channel.mask & *bits) != 0)
      diagnostics.error(
          entry.at,
          fmt::format("channel '{}' has the bits {:#x} in 'mask' and in '{}'", entry.key, *channel.mask & *bits, key),
          "a bit belongs to the value or is a status bit: mask: 0x0fff, saturated: 0x8000");
  }
  channel.signed_bits = static_cast<std::uint32_t>(reader.whole_number("signed_bits", "12", 0, 2, 32));
  if (channel.mask && channel.signed_bits != 0)
    diagnostics.error(entry.at, fmt::format("channel '{}' has 'mask' and 'signed_bits'", entry.key),
                      "give one: signed_bits: 12 is mask: 0x0fff, with the twelfth bit as the sign");
  if (channel.signed_bits != 0 && status % (std::uint64_t{1} << channel.signed_bits) != 0)
    diagnostics.error(entry.at, fmt::format("channel '{}' has status bits among its 'signed_bits'", entry.key),
                      "a bit belongs to the value or is a status bit: signed_bits: 12, saturated: 0x8000");
  if (status != 0 && !channel.mask && channel.signed_bits == 0) channel.mask = ~status;
  if (const config::Entry* reversed = reader.take("reversed")) {
    const auto parsed = parse_axes(joined(reversed->value));
    if (parsed && std::ranges::all_of(*parsed, [](Axis axis) { return axis == Axis::row || axis == Axis::column; }))
      channel.reversed = *parsed;
    else
      diagnostics.error(reversed->value.at,
                        fmt::format("'reversed' must be axes of the image, found '{}'", joined(reversed->value)),
                        "names: row, column; example: reversed: row column, of an image that is turned by 180 deg");
  }
  channel.zero = reader.number("zero", "", "2048", 0);
  reader.finish();
  return channel;
}

PerFrame read_per_frame(config::Reader& reader, std::string_view key, std::string_view unit, std::string_view example,
                        config::Diagnostics& diagnostics) {
  PerFrame result;
  const config::Entry* entry = reader.take(key);
  if (entry == nullptr) return result;
  if (entry->value.is_map()) {
    config::Reader inner(entry->value, diagnostics, fmt::format("'{}'", key));
    if (const config::Entry* array = inner.need("array", "time")) result.array = array->value.text;
    if (const config::Entry* of = inner.need("unit", "ms")) result.unit = of->value.text;
    inner.finish();
    return result;
  }
  const config::Quantity quantity = config::parse_quantity(entry->value.text, unit);
  if (quantity.ok() && key != "timestamp")
    result.value = quantity.value;
  else
    diagnostics.error(
        entry->value.at,
        fmt::format("'{}' must be a quantity or the name of an array, found {}", key, entry->value.described()),
        fmt::format("example: {}: {}, or {}: {{array: NAME, unit: {}}}", key, example, key, unit));
  return result;
}

HeaderlessArray read_headerless(const config::Entry& entry, config::Diagnostics& diagnostics) {
  HeaderlessArray array{.name = entry.key};
  config::Reader reader(entry.value, diagnostics, fmt::format("array '{}'", entry.key));
  static constexpr std::pair<std::string_view, std::uint32_t> kinds[] = {
      {"uint", TOFGRAPH_ELEMENT_UNSIGNED}, {"int", TOFGRAPH_ELEMENT_SIGNED}, {"float", TOFGRAPH_ELEMENT_FLOAT}};
  if (const config::Entry* type = reader.need("type", "uint16")) {
    for (const auto& [name, kind] : kinds) {
      for (const std::uint32_t bytes : {1U, 2U, 4U, 8U}) {
        if (type->value.text != fmt::format("{}{}", name, 8 * bytes)) continue;
        if (kind == TOFGRAPH_ELEMENT_FLOAT && bytes < 4) continue;
        array.kind = kind;
        array.bytes = bytes;
      }
    }
    if (array.bytes == 0)
      diagnostics.error(type->value.at, fmt::format("'type' is {}, which is unknown", type->value.described()),
                        "types: int8, int16, int32, int64, uint8, uint16, uint32, uint64, float32, float64");
  }
  const std::vector<std::string> orders = {"little", "big"};
  array.big_endian = reader.choice("byte_order", orders) == "big";
  if (const config::Entry* shape = reader.need("shape", "[4, 204, 204, 2]")) {
    for (const double size : numbers_of(*shape, diagnostics)) {
      if (size >= 1 && size == std::floor(size) && size < 1e6)
        array.shape.push_back(static_cast<std::uint64_t>(size));
      else
        diagnostics.error(shape->value.at, "'shape' must be whole numbers of at least 1",
                          "example: shape: [4, 204, 204, 2]");
    }
    double bytes = array.bytes;
    for (const std::uint64_t size : array.shape) bytes *= static_cast<double>(size);
    if (bytes > 1e12) diagnostics.error(shape->value.at, fmt::format("'shape' is {:.3g} TB per frame", bytes / 1e12));
    if (array.shape.empty() || array.shape.size() > 5)
      diagnostics.error(shape->value.at, "'shape' must have one to five numbers", "example: shape: [4, 204, 204, 2]");
  }
  array.image_header = static_cast<std::uint64_t>(reader.whole_number("image_header", "512", 0, 0, 1 << 24));
  reader.finish();
  return array;
}

}  // namespace

std::optional<std::vector<Axis>> parse_axes(std::string_view names) {
  std::vector<Axis> axes;
  for (const std::string_view word : words_of(names)) {
    const auto found = std::ranges::find(axis_names, word);
    if (found == std::end(axis_names)) return std::nullopt;
    const auto axis = static_cast<Axis>(found - std::begin(axis_names));
    if (std::ranges::find(axes, axis) != axes.end()) return std::nullopt;
    axes.push_back(axis);
  }
  return axes;
}

std::string axes_text(const std::vector<Axis>& axes) {
  std::string text;
  for (const Axis axis : axes) {
    text += text.empty() ? "" : " ";
    text += axis_names[static_cast<std::size_t>(axis)];
  }
  return text;
}

Layout read_layout(const config::Value& document, config::Diagnostics& diagnostics) {
  config::check_version(document, "layout", 1, diagnostics);
  Layout layout;
  config::Reader reader(document, diagnostics, "the layout");
  reader.take("layout");
  if (const config::Entry* camera = reader.take("camera")) {
    const std::string& text = camera->value.text;
    const bool path = text.find('/') != std::string::npos || text.ends_with(".yaml");
    layout.camera = path ? std::filesystem::absolute(config::path_at(text, camera->value.at)).string() : text;
  }
  if (const config::Entry* channels = reader.need("channels", "{depth: {unit: mm}}")) {
    if (!channels->value.is_map() || channels->value.entries.empty())
      diagnostics.error(channels->value.at,
                        fmt::format("'channels' must name channels, found {}", channels->value.described()),
                        "example: channels: {depth: {array: depth, axes: row column, unit: mm}}");
    for (const config::Entry& entry : channels->value.entries)
      layout.channels.push_back(read_channel(entry, diagnostics));
  }
  layout.integration_time = read_per_frame(reader, "integration_time", "s", "1 ms", diagnostics);
  layout.modulation_frequency = read_per_frame(reader, "modulation_frequency", "Hz", "20 MHz", diagnostics);
  layout.timestamp = read_per_frame(reader, "timestamp", "s", "0 s", diagnostics);
  layout.time_since_power_on = read_per_frame(reader, "time_since_power_on", "s", "2 h", diagnostics);
  layout.frame_rate = reader.number_within("frame_rate", "Hz", "30 Hz", io::unknown, 1e-6, 1e9);
  layout.file_header = static_cast<std::uint64_t>(reader.whole_number("file_header", "64", 0, 0, 1 << 30));
  layout.frame_header = static_cast<std::uint64_t>(reader.whole_number("frame_header", "16", 0, 0, 1 << 30));
  if (const config::Entry* arrays = reader.take("arrays")) {
    if (!arrays->value.is_map())
      diagnostics.error(arrays->value.at, fmt::format("'arrays' must name arrays, found {}", arrays->value.described()),
                        "example: arrays: {raw: {type: uint16, shape: [4, 204, 204, 2]}}");
    for (const config::Entry& entry : arrays->value.entries)
      layout.headerless.push_back(read_headerless(entry, diagnostics));
  }
  reader.finish();
  return layout;
}

Layout read_layout(const std::filesystem::path& file) {
  config::Diagnostics diagnostics;
  Layout layout = read_layout(config::load_document(file), diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  return layout;
}

}  // namespace tofgraph::foreign
