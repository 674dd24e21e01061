// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/palettes.hpp"
#include "live/http.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace tofgraph::live {
namespace {

std::string colours_script() {
  std::string flags;
  for (const io::FlagColour& flag : io::flag_colours)
    flags += fmt::format("  {{bit: {}, name: '{}', colour: {:#x}}},\n", flag.bit, flag.name, flag.colour);
  return fmt::format(
      "export const RISING = [{:#x}];\nexport const LINES = [{:#x}];\nexport const FLAGS = [\n{}];\n"
      "export const INVALID = {:#x}, NO_FLAG = {:#x}, OTHER_FLAG = {:#x};\n",
      fmt::join(io::rising_colours, ", "), fmt::join(io::line_colours, ", "), flags, io::invalid_colour,
      io::no_flag_colour, io::other_flag_colour);
}

}  // namespace

const std::map<std::string_view, PageFile>& page_files() {
  static const std::string colours = colours_script();
  static const std::map<std::string_view, PageFile> files = [] {
    auto all = written_page_files();
    all["/colours.js"] = {"text/javascript; charset=utf-8", colours};
    return all;
  }();
  return files;
}

}  // namespace tofgraph::live
