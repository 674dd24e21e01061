// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/command_line.hpp"
#include "cli/commands.hpp"
#include "config/json_text.hpp"

#include "config/paths.hpp"
#include "io/profile.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include <tofgraph/physics/exposures.hpp>
#include <tofgraph/physics/unwrapping.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tofgraph::cli {
namespace {

using nlohmann::json;

/// Plugins of the given kinds.
json plugins(const Common& common, std::initializer_list<std::string_view> kinds) {
  const graph::PluginRegistry registry(common.plugin_folders);
  std::vector<graph::PluginFile> files;
  for (const graph::PluginFile& file : registry.files()) {
    if (std::ranges::find(kinds, file.kind) != kinds.end()) files.push_back(file);
  }
  const auto seen = registry.describe(files);
  json list = json::array();
  for (const graph::PluginFile& file : files) {
    const json& plugin = seen.at(file.path.string());
    json entry = {{"name", file.name}, {"kind", file.kind}, {"file", file.path.string()}};
    if (plugin.contains("error"))
      entry["error"] = plugin["error"];
    else
      entry["summary"] = plugin["summary"];
    list.push_back(std::move(entry));
  }
  return list;
}

json cameras() {
  json list = json::array();
  for (const std::string& name : io::profile_names()) {
    const auto camera = io::load_profile(io::find_profile(name, {}));
    const auto& c = camera->view();
    list.push_back({{"name", name},
                    {"kind", "camera"},
                    {"summary", fmt::format("{} x {} px", c.width, c.height)},
                    {"file", camera->file.string()}});
  }
  return list;
}

/// Tables 1.1 and 1.2 of the reference for all profiles: one column per property.
void compare_cameras() {
  fmt::print("{:20} {:>10}  {:26} {:>14} {:>13} {:>12} {:>16} {:12}\n", "camera", "pixels", "sensor", "range", "view",
             "frames/s", "unambiguous", "interface");
  const auto shown = [](double value, const char* format) {
    return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : std::string("?");
  };
  for (const std::string& name : io::profile_names()) {
    const auto camera = io::load_profile(io::find_profile(name, {}));
    const tofgraph_camera& c = camera->view();
    const io::DataSheet& sheet = camera->data_sheet;
    const auto angle = [&](int axis, double pixels) {  // from the pinhole model if the data sheet does not state it
      const double stated = sheet.field_of_view[static_cast<std::size_t>(axis)];
      return (std::isfinite(stated) ? stated : 2 * std::atan(pixels / 2 / c.focal_px[axis])) * 180 / std::numbers::pi;
    };
    const std::string range = std::isfinite(sheet.measuring_range[0])
                                  ? fmt::format("{:g} to {:g} m", sheet.measuring_range[0], sheet.measuring_range[1])
                                  : "?";
    const double unambiguous = physics::unambiguous_range(
        physics::common_frequency(physics::frequencies_of(physics::exposures_of(c), c.modulation_frequency)));
    fmt::print("{:20} {:>10}  {:26} {:>14} {:>13} {:>12} {:>16} {:12}\n", name,
               fmt::format("{} x {}", c.width, c.height), sheet.sensor.empty() ? "?" : sheet.sensor, range,
               fmt::format("{:.0f} x {:.0f} deg", angle(0, c.width), angle(1, c.height)), shown(c.frame_rate, "{:g}"),
               shown(unambiguous, "{:.2f} m"), sheet.interface.empty() ? "?" : sheet.interface);
  }
  fmt::print("?: the profile does not state it. A view without a data sheet is that of its focal length.\n");
}

/// Warns of files in plugin folders that are not named like plugins, once per folder.
void warn_unrecognised(const Common& common) {
  for (const auto& folder : common.plugin_folders) {
    std::vector<std::string> strays;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
      if (graph::plugin_file(entry.path()).kind.empty()) strays.push_back(entry.path().filename().string());
    }
    std::ranges::sort(strays);
    if (strays.empty()) continue;
    print_message(fmt::format(
        "warning: {}: ignored, because a plugin must be called tofgraph_KIND_NAME.so (KIND: source, filter, sink, "
        "effect, format): {}",
        folder.string(), fmt::join(strays, ", ")));
  }
}

void print(const json& list, bool with_files) {
  std::string kind;
  for (const char* wanted : {"source", "filter", "sink", "effect", "format", "camera"}) {
    for (const json& entry : list) {
      if (entry["kind"] != wanted) continue;
      if (kind != wanted) fmt::print("{}{}s\n", kind.empty() ? "" : "\n", wanted);
      kind = wanted;
      const std::string text = entry.contains("error") ? "cannot be used" : entry["summary"].get<std::string>();
      fmt::print("  {:28} {}\n", entry["name"].get<std::string>(),
                 with_files ? entry["file"].get<std::string>() : text);
      if (entry.contains("error")) print_message(fmt::format("warning: {}", entry["error"].get<std::string>()));
    }
  }
}

int list(const std::string& what, bool as_json, bool compare, const Common& common) {
  if (compare && (what != "cameras" || as_json))
    throw config::ConfigurationError("--compare: error: is for the table of cameras: tofgraph list cameras --compare");
  if (compare) {
    compare_cameras();
    return done;
  }
  json entries;
  if (what == "effects")
    entries = plugins(common, {"effect"});
  else if (what == "formats")
    entries = plugins(common, {"format"});
  else if (what == "cameras")
    entries = cameras();
  else
    entries = plugins(common, {"source", "filter", "sink"});
  if (what == "plugins") {
    for (json& other : plugins(common, {"effect", "format"})) entries.push_back(std::move(other));
  }
  if (what != "cameras" && !common.quiet) warn_unrecognised(common);
  if (what != "cameras") warn_shadowed(graph::PluginRegistry(common.plugin_folders), common);
  if (as_json)
    fmt::print("{}\n", config::json_text(entries, 2));
  else
    print(entries, what == "plugins");
  return done;
}

}  // namespace

void add_list(CLI::App& app, Common& common) {
  auto what = std::make_shared<std::string>("stages");
  auto as_json = std::make_shared<bool>(false), compare = std::make_shared<bool>(false);
  CLI::App* command = app.add_subcommand("list", "List stages, effects, file formats, cameras or plugin files");
  command->footer("Example: tofgraph list effects");
  command->add_option("WHAT", *what, "stages (default), effects, formats, cameras or plugins")
      ->check(one_of({"stages", "effects", "formats", "cameras", "plugins"}));
  command->add_flag("--json", *as_json, "As JSON");
  command->add_flag("--compare", *compare, "cameras: sensor, range, view, frame rate and interface side by side");
  command->callback(
      [=, &common] { common.command = [=, &common] { return list(*what, *as_json, *compare, common); }; });
}

}  // namespace tofgraph::cli
