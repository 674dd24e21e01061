// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "cli/commands.hpp"
#include "config/json_text.hpp"

#include "config/quantity.hpp"
#include "io/profile.hpp"

#include <tofgraph/physics/unwrapping.hpp>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>

namespace tofgraph::cli {
namespace {

using nlohmann::json;

std::string text_of(const json& object, const char* key) {
  return object[key].is_string() ? object[key].get<std::string>() : "";
}

std::string bounds(const json& parameter) {
  const std::string unit = text_of(parameter, "unit");
  const json& low = parameter["minimum"];
  const json& high = parameter["maximum"];
  const auto shown = [&](const json& value) { return config::format_quantity(value.get<double>(), unit); };
  if (low.is_null() && high.is_null()) return unit.empty() ? "" : fmt::format(", unit {}", unit);
  if (high.is_null()) return fmt::format(", at least {}", shown(low));
  if (low.is_null()) return fmt::format(", at most {}", shown(high));
  return fmt::format(", {} to {}", shown(low), shown(high));
}

/// Value at which an effect's parameter has no effect, and a typical size.
std::string typical(const json& p) {
  const auto shown = [&](const char* key) { return config::format_quantity(p[key].get<double>(), text_of(p, "unit")); };
  std::string text;
  if (p.contains("off")) text += fmt::format("; off at {}", shown("off"));
  if (p.contains("typical")) text += fmt::format("; typically {}", shown("typical"));
  return text;
}

void print_parameter(const json& p) {
  std::string type = text_of(p, "type");
  if (p.contains("choices")) type += fmt::format(" ({})", text_of(p, "choices"));
  if (p.contains("companions")) type += fmt::format(" (and {} next to it)", text_of(p, "companions"));
  const std::string otherwise =
      p["required"].get<bool>() ? "required"
      : p["default"].is_null()
          ? "optional"
          : fmt::format("default {}", text_of(p, "default").empty() ? "''" : text_of(p, "default"));
  fmt::print("  {:24} {}{}; {}{}\n  {:24} {}\n", text_of(p, "name"), type, bounds(p), otherwise, typical(p), "",
             text_of(p, "text"));
}

/// Prints corrections that a port's channel needs or refuses, its origin and its class.
void print_meaning(const json& port) {
  std::string text;
  for (const char* key : {"needs", "refuses", "from", "adds", "of"}) {
    if (port.contains(key)) text += fmt::format("{}{} {}", text.empty() ? "" : "; ", key, text_of(port, key));
  }
  if (!text.empty()) fmt::print("  {:24} {}\n", "", text);
}

void print(const json& plugin) {
  fmt::print("{} {} (version {}): {}\n", text_of(plugin, "kind"), text_of(plugin, "name"), text_of(plugin, "version"),
             text_of(plugin, "summary"));
  for (const char* key : {"author", "licence", "file"}) {
    if (!text_of(plugin, key).empty()) fmt::print("{}: {}\n", key, text_of(plugin, key));
  }
  for (const char* direction : {"in", "inout", "out"}) {
    static const std::map<std::string, const char*> titles = {{"in", "reads"}, {"inout", "changes"}, {"out", "makes"}};
    bool first = true;
    for (const json& port : plugin["ports"]) {
      if (port["direction"] != direction) continue;
      if (first) fmt::print("\n{}\n", titles.at(direction));
      first = false;
      const std::string shape = text_of(port, "shape"), unit = text_of(port, "unit");
      fmt::print("  {:24} {}{}{}{}{}\n", text_of(port, "channel"), text_of(port, "type"),
                 shape.empty() ? "" : " [" + shape + "]", unit.empty() ? "" : " " + unit,
                 port["optional"].get<bool>() ? ", optional" : "",
                 text_of(port, "text").empty() ? "" : "; " + text_of(port, "text"));
      print_meaning(port);
    }
  }
  if (plugin.contains("level")) {
    fmt::print("\nacts on the {}; belongs to the {}; touches {}\n", text_of(plugin, "level"),
               text_of(plugin, "belongs_to"), text_of(plugin, "touches"));
    if (!text_of(plugin, "confused_with").empty()) fmt::print("confused with: {}\n", text_of(plugin, "confused_with"));
    if (!text_of(plugin, "experiment").empty()) fmt::print("separated by: {}\n", text_of(plugin, "experiment"));
  }
  if (!plugin["parameters"].empty()) fmt::print("\nparameters\n");
  for (const json& parameter : plugin["parameters"]) print_parameter(parameter);
}

/// Distance at which all frequencies repeat together, m; null if they do not or if a frequency is unknown.
json unambiguous_range_of(const physics::Exposures& exposures, double own) {
  const std::vector<double> frequencies = physics::frequencies_of(exposures, own);
  if (std::ranges::any_of(frequencies, [](double f) { return !(f > 0); })) return nullptr;
  const double common = physics::common_frequency(frequencies);
  return common > 0 ? json(physics::unambiguous_range(common)) : json(nullptr);
}

/// Prints a camera profile as a file, each key with the origin of its value.
json profile(const std::filesystem::path& file) {
  const auto camera = io::load_profile(file);
  json values = json::array();
  for (const config::Entry& entry : config::load_document(file).entries) {
    if (entry.key == "profile" || entry.key == "name" || entry.key == "measured" || entry.key == "assumed" ||
        entry.key == "source")
      continue;
    const auto is_in = [&](const std::vector<std::string>& keys) {
      return std::ranges::find(keys, entry.key) != keys.end();
    };
    values.push_back({{"key", entry.key},
                      {"value", config::yaml_text(entry.value)},
                      {"measured", is_in(camera->measured)},
                      {"assumed", is_in(camera->assumed)}});
  }
  const config::Value document = config::load_document(file);
  const physics::Exposures exposures = physics::exposures_of(camera->view());
  const config::Entry* source = document.find("source");
  return {{"kind", "camera"},
          {"name", camera->view().name},
          {"file", file.string()},
          {"values", values},
          {"exposures", physics::exposures_text(exposures)},
          {"unambiguous_range_m", unambiguous_range_of(exposures, camera->view().modulation_frequency)},
          {"source", source != nullptr ? source->value.text : ""}};
}

void print_profile(const json& camera) {
  fmt::print("camera {}: {}\n\n", text_of(camera, "name"), text_of(camera, "file"));
  for (const json& value : camera["values"])
    fmt::print("  {:24} {:9} {}{}\n", text_of(value, "key"),
               value["measured"].get<bool>()  ? "measured"
               : value["assumed"].get<bool>() ? "assumed"
                                              : "nominal",
               text_of(value, "value"),
               text_of(value, "key") == "principal_point" ? " px, the first pixel's centre is 0" : "");
  const json& range = camera["unambiguous_range_m"];
  fmt::print("\na frame: {}{}\n", text_of(camera, "exposures"),
             range.is_null() ? "; the unambiguous range is unknown"
                             : fmt::format("; unambiguous to {:.4g} m", range.get<double>()));
  if (!text_of(camera, "source").empty()) fmt::print("\nsource: {}\n", text_of(camera, "source"));
}

int describe_profile(const std::filesystem::path& file, bool as_json) {
  const json camera = profile(file);
  if (as_json)
    fmt::print("{}\n", config::json_text(camera, 2));
  else
    print_profile(camera);
  return done;
}

int describe(const std::string& name, bool as_json, const Common& common) {
  const graph::PluginRegistry registry(common.plugin_folders);
  const graph::PluginFile* file = registry.find(name);
  const std::filesystem::path camera = io::find_profile(name, std::filesystem::current_path());
  if (file == nullptr && !camera.empty()) return describe_profile(camera, as_json);
  if (file == nullptr) {
    std::vector<std::string> names = registry.names();
    for (const graph::PluginFile& other : registry.files()) {
      if (!other.is_stage()) names.push_back(other.name);
    }
    for (std::string& other : io::profile_names()) names.push_back(std::move(other));
    throw config::ConfigurationError(fmt::format("error: there is no stage, effect, format or camera '{}'\n         {}",
                                                 name, config::suggestion(name, names, "there are")));
  }
  const json plugin = registry.describe({*file}).at(file->path.string());
  if (plugin.contains("error")) throw config::ConfigurationError("error: " + plugin["error"].get<std::string>());
  warn_shadowed(registry, common, name);
  if (as_json)
    fmt::print("{}\n", config::json_text(plugin, 2));
  else
    print(plugin);
  return done;
}

}  // namespace

void add_describe(CLI::App& app, Common& common) {
  auto name = std::make_shared<std::string>();
  auto as_json = std::make_shared<bool>(false);
  CLI::App* command = app.add_subcommand(
      "describe",
      "Show what a stage or effect reads and makes and which parameters it has, or what is known of a camera");
  command->footer("Example: tofgraph describe non_local_means");
  command->add_option("NAME", *name, "A stage, an effect, or a camera profile by name or path")->required();
  command->add_flag("--json", *as_json, "As JSON");
  command->callback([=, &common] { common.command = [=, &common] { return describe(*name, *as_json, common); }; });
}

}  // namespace tofgraph::cli
