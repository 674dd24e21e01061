// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Lists the content of another program's file and suggests a layout.
#include "cli/convert.hpp"
#include "config/diagnostics.hpp"
#include "config/log.hpp"
#include "config/quantity.hpp"
#include "foreign/headerless_file.hpp"
#include "foreign/readings.hpp"
#include "foreign/series.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace tofgraph::cli {
namespace {

using namespace foreign;

/// Guesses the channel of an array from its name.
std::string likely_channel(const FileArray& array) {
  std::string name = array.name;
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  static constexpr std::pair<std::string_view, std::string_view> words[] = {
      {"depth", "depth"},    {"range", "range"},      {"dist", "distance"},  {"ampl", "amplitude"},
      {"conf", "amplitude"}, {"intens", "intensity"}, {"gray", "intensity"}, {"grey", "intensity"},
      {"phase", "phases"},   {"dcs", "phases"},       {"raw", "phases"},     {"tap", "taps"},
      {"point", "points"},   {"xyz", "points"},       {"sigma", "sigma"}};
  for (const auto& [word, channel] : words) {
    if (name.find(word) != std::string::npos) return std::string(channel);
  }
  return "";
}

std::string percent(double share) {  // two significant digits
  return share < 0.1 ? fmt::format("{:.2g} %", 100 * share) : fmt::format("{:.0f} %", 100 * share);
}

/// Channel that is read from an array, or one without settings.
ChannelLayout channel_of(const Layout& layout, const ForeignFile& file, std::size_t index) {
  for (const ChannelLayout& channel : layout.channels) {
    const std::string& name = channel.array.empty() ? channel.channel : channel.array;
    if (name == file.arrays()[index].name || (channel.array.empty() && file.arrays().size() == 1)) return channel;
  }
  return {};
}

/// @param layout null: none; otherwise the bits that are set in any integer are printed
void print_array(const ForeignFile& file, std::size_t index, const Layout* layout) {
  const FileArray& array = file.arrays()[index];
  fmt::print("  {:<20} {:<8} {:<18}", array.name.empty() ? "(one array)" : array.name, element_text(array),
             shape_text(array));
  if (array.elements() == 0) return fmt::print(" empty\n");
  const ChannelLayout channel = layout != nullptr ? channel_of(*layout, file, index) : ChannelLayout();
  ValueRange range;
  try {
    range = range_of(file, index, channel);
  } catch (const ForeignError& error) {  // others can be read
    return fmt::print(" {}\n", error.what());
  }
  if (range.minimum <= range.maximum) fmt::print(" {:.6g} to {:.6g}", range.minimum, range.maximum);
  if (array.elements() >= 1000 && range.found && (range.low != range.minimum || range.high != range.maximum))
    fmt::print(", 98 % of the positive within {:.6g} to {:.6g}", range.low, range.high);
  fmt::print("{}, {} zeros", range.found ? "" : ", nothing above 0", percent(range.zeros));
  if (range.negative > 0) fmt::print(", {} negative", percent(range.negative));
  if (range.no_numbers > 0) fmt::print(", {} NaN or infinite", percent(range.no_numbers));
  std::vector<double> codes = channel.invalid;  // the option replaces the stated ones
  for (const io::CountedValue& code : range.codes) {
    fmt::print(", {} times {}: probably a code", code.count, code.value);
    codes.push_back(code.value);
  }
  if (!range.codes.empty()) fmt::print(", --invalid {}", fmt::join(codes, ","));
  if (layout != nullptr && range.bits != 0) fmt::print(", bits set {:#x}", range.bits);
  if (!array.unit.empty()) fmt::print(", in {}", array.unit);
  if (!array.text.empty()) fmt::print("  ({})", array.text);
  fmt::print("\n");
}

void print_layout(const ForeignFile& file) {
  fmt::print("\nA layout to start from; replace the parts in <>:\n\nlayout: 1\nchannels:\n");
  for (std::size_t i = 0; i < file.arrays().size(); ++i) {
    const FileArray& array = file.arrays()[i];
    const std::string channel = likely_channel(array);
    if (array.extent.size() < 2) continue;
    const auto possible = possible_axes(shape_of(array), channel.empty() ? "depth" : channel, nullptr);
    const std::string axes = !array.axes.empty() ? array.axes
                             : possible.size() == 1
                                 ? axes_text(possible.front())
                                 : std::string("<") + (array.extent.size() > 2 ? "frame " : "") + "row column>";
    const bool length = channel.empty() || channel == "depth" || channel == "range" || channel == "distance";
    fmt::print("  {}: {{{}axes: {}{}}}\n", channel.empty() ? "<depth, range, amplitude, ..>" : "<" + channel + ">",
               array.name.empty() ? "" : fmt::format("array: {}, ", config::yaml_word(array.name)), axes,
               length ? fmt::format(", unit: {}", array.unit.empty() ? "<mm>" : array.unit) : "");
  }
  for (std::size_t i = 0; i < file.arrays().size(); ++i) {
    const FileArray& array = file.arrays()[i];
    if (array.extent.size() < 2) continue;
    ValueRange range;
    try {
      range = range_of(file, i);
    } catch (const ForeignError&) {  // reported beside the array
    }
    if (!range.found) continue;
    fmt::print("\nIf {} is a length, its values are\n", array.name.empty() ? "the array" : "'" + array.name + "'");
    for (const std::string& line : unit_readings(range)) fmt::print("  {}\n", line);
  }
}

/// Opens a file with its format, or as its layout describes. @throws ForeignError
ForeignFile opened(const Formats& formats, const std::filesystem::path& path, const Layout& layout) {
  if (layout.headerless.empty()) return {formats, path};
  try {
    return {path, std::make_shared<HeaderlessFile>(path, layout)};
  } catch (const std::runtime_error& error) {
    throw ForeignError(fmt::format("{}: the file {}", path.string(), error.what()));
  }
}

int inspect(const InspectFileArguments& arguments) {
  const graph::PluginRegistry registry(arguments.plugin_folders);
  const Formats formats(registry);
  const Layout layout = arguments.layout.empty() ? Layout() : read_layout(arguments.layout);
  try {
    for (const std::string& pattern : arguments.files) {
      for (const auto& path : files_of(pattern)) {
        const ForeignFile file = opened(formats, path, layout);
        fmt::print("{}: format {}, {}\n", path.string(), file.format(), config::counted(file.arrays().size(), "array"));
        for (std::size_t i = 0; i < file.arrays().size(); ++i)
          print_array(file, i, arguments.layout.empty() ? nullptr : &layout);
        if (!file.profile().empty()) fmt::print("  with a camera profile\n");
        if (arguments.files.size() == 1 && arguments.layout.empty()) print_layout(file);
        if (pattern.find_first_of("*?") != std::string::npos) break;  // the first of a series
      }
    }
  } catch (const ForeignError& error) {
    throw config::ConfigurationError(fmt::format("error: {}", error.what()));
  }
  return 0;
}

}  // namespace
}  // namespace tofgraph::cli

extern "C" __attribute__((visibility("default"))) int tofgraph_command(const void* arguments) {
  return tofgraph::cli::inspect(*static_cast<const tofgraph::cli::InspectFileArguments*>(arguments));
}
