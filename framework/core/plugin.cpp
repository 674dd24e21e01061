// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "core/plugin.hpp"

#include "core/diagnostics.hpp"
#include "core/paths.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include <tofgraph/array.hpp>

namespace tofgraph::core {
namespace {

[[noreturn]] void refuse(const PluginFile& file, const std::string& reason, const std::string& advice) {
  throw PluginError(fmt::format("plugin {}: {}\n         {}", file.path.string(), reason, advice));
}

/// Why dlopen failed, in words that name the missing piece.
[[noreturn]] void refuse_library(const PluginFile& file, const std::string& error) {
  if (const auto found = error.find("undefined symbol: "); found != std::string::npos) {
    refuse(file,
           fmt::format("needs the symbol '{}', which no library it was linked with has", error.substr(found + 18)),
           "link the library that defines it");
  }
  if (const auto found = error.find(": cannot open shared object file");
      found != std::string::npos && !error.starts_with(file.path.string())) {
    refuse(file, fmt::format("needs the library '{}', which is not installed", error.substr(0, found)),
           "install the package that has it, or set its folder in LD_LIBRARY_PATH");
  }
  refuse(file, "cannot be loaded: " + error, "is it a shared library for this machine?");
}

void check_version(const PluginFile& file, const tofgraph_descriptor& d) {
  const auto version = [](std::uint32_t major, std::uint32_t minor) { return fmt::format("{}.{}", major, minor); };
  if (d.api_major == TOFGRAPH_API_MAJOR && d.api_minor <= TOFGRAPH_API_MINOR) return;
  const bool newer = d.api_major > TOFGRAPH_API_MAJOR || d.api_major == TOFGRAPH_API_MAJOR;
  refuse(file,
         fmt::format("was built for plugin API {}, this program has {}", version(d.api_major, d.api_minor),
                     version(TOFGRAPH_API_MAJOR, TOFGRAPH_API_MINOR)),
         newer ? "install a newer tofgraph, or build the plugin against this one"
               : "build the plugin anew against this tofgraph");
}

void check_descriptor(const PluginFile& file, const tofgraph_descriptor* d) {
  const std::string advice = "build it with TOFGRAPH_STAGE or TOFGRAPH_EFFECT and tofgraph_add_plugin()";
  const bool effect = file.kind == "effect";
  if (d == nullptr) refuse(file, "its tofgraph_plugin() gave no descriptor", advice);
  check_version(file, *d);
  if (d->size < sizeof(tofgraph_descriptor))
    refuse(file, fmt::format("its descriptor has {} bytes, expected {}", d->size, sizeof(tofgraph_descriptor)), advice);
  const bool complete =
      d->kind != nullptr && d->name != nullptr && d->summary != nullptr && d->version != nullptr &&
      d->create != nullptr && d->prepare != nullptr && (d->process != nullptr || effect) && d->destroy != nullptr &&
      (d->port_count == 0 || (d->ports != nullptr && d->port_size == sizeof(tofgraph_port))) &&
      (d->parameter_count == 0 || (d->parameters != nullptr && d->parameter_size == sizeof(tofgraph_parameter)));
  if (!complete) refuse(file, "its descriptor is not complete", advice);
  if (file.kind != d->kind || file.name != d->name) {
    refuse(file, fmt::format("calls itself {} '{}'", d->kind, d->name),
           "name the file tofgraph_KIND_NAME.so after what is in it");
  }
  if ((d->flags & TOFGRAPH_MANY_INPUTS) != 0 && std::string_view(d->kind) != "sink") {
    refuse(file,
           fmt::format("is a {} over any number of streams: only a sink can be, a {} has one frame to hand on", d->kind,
                       d->kind),
           "take one frame: process(Frame&); streams that belong together are joined with inputs: [a, b]");
  }
  if (effect && effect_of(*d) == nullptr) {
    refuse(file, "has no extension \"effect\" of version 1 with a level and apply()",
           "end the file with TOFGRAPH_EFFECT(Class, \"text\")");
  }
}

/// A bound as data: NaN, "no bound", is null.
nlohmann::json number_or_null(double value) { return std::isnan(value) ? nlohmann::json() : nlohmann::json(value); }

nlohmann::json describe_port(const tofgraph_port& port) {
  static constexpr const char* directions[] = {"", "in", "out", "inout"};
  return {{"name", port.name},
          {"direction", directions[port.direction & 3U]},
          {"channel", port.channel},
          {"shape", port.shape},
          {"type", element_name(port.type)},
          {"unit", port.unit},
          {"optional", (port.flags & TOFGRAPH_OPTIONAL) != 0},
          {"text", port.text}};
}

nlohmann::json describe_parameter(const tofgraph_parameter& p) {
  static constexpr const char* kinds[] = {"",       "bool",    "integer",    "number",     "text",
                                          "choice", "numbers", "input file", "output file"};
  nlohmann::json json = {{"name", p.name},
                         {"type", p.kind < std::size(kinds) ? kinds[p.kind] : "unknown"},
                         {"unit", p.unit},
                         {"required", p.required != 0},
                         {"text", p.text},
                         {"default", p.fallback != nullptr ? nlohmann::json(p.fallback) : nlohmann::json()},
                         {"minimum", number_or_null(p.minimum)},
                         {"maximum", number_or_null(p.maximum)}};
  if (*p.choices != 0) json[p.kind == TOFGRAPH_OUTPUT_FILE ? "companions" : "choices"] = p.choices;
  if (!std::isnan(p.off)) json["off"] = p.off;
  if (!std::isnan(p.typical)) json["typical"] = p.typical;
  return json;
}

}  // namespace

const tofgraph_effect* effect_of(const tofgraph_descriptor& d) {
  for (std::uint64_t i = 0; i < d.extension_count && d.extensions != nullptr; ++i) {
    const tofgraph_extension& extension = d.extensions[i];
    if (std::strcmp(extension.name, "effect") != 0 || extension.version != 1) continue;
    const auto* effect = static_cast<const tofgraph_effect*>(extension.data);
    const bool complete = effect != nullptr && effect->size >= sizeof(tofgraph_effect) && effect->apply != nullptr &&
                          effect->level >= TOFGRAPH_GEOMETRY && effect->level <= TOFGRAPH_TAPS &&
                          effect->touches != nullptr && effect->confused_with != nullptr &&
                          effect->experiment != nullptr;
    return complete ? effect : nullptr;
  }
  return nullptr;
}

const char* level_name(const tofgraph_effect& effect) {
  static constexpr const char* names[] = {"", "geometry", "phasor", "samples", "taps"};
  return names[effect.level];
}

PluginFile plugin_file(const std::filesystem::path& path) {
  const std::string name = path.filename().string();
  for (const char* kind : {"source", "filter", "sink", "effect"}) {
    const std::string prefix = fmt::format("tofgraph_{}_", kind);
    if (name.starts_with(prefix) && name.ends_with(".so") && name.size() > prefix.size() + 3) {
      return {kind, name.substr(prefix.size(), name.size() - prefix.size() - 3), path};
    }
  }
  return {};
}

const tofgraph_descriptor& load_plugin(const PluginFile& file) {
  void* library = dlopen(file.path.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  if (library == nullptr) refuse_library(file, dlerror());
  dlerror();
  void* symbol = dlsym(library, TOFGRAPH_PLUGIN_SYMBOL);
  if (symbol == nullptr) {
    refuse(file, "has no symbol '" TOFGRAPH_PLUGIN_SYMBOL "'",
           "a plugin exports it: write TOFGRAPH_STAGE(Class, \"text\") at the end of its file");
  }
  const tofgraph_descriptor* descriptor = reinterpret_cast<tofgraph_plugin_function>(symbol)();
  check_descriptor(file, descriptor);
  return *descriptor;
}

nlohmann::json describe(const tofgraph_descriptor& d) {
  nlohmann::json json = {{"kind", d.kind},
                         {"name", d.name},
                         {"summary", d.summary},
                         {"version", d.version},
                         {"api", fmt::format("{}.{}", d.api_major, d.api_minor)},
                         {"stateless", (d.flags & TOFGRAPH_STATELESS) != 0},
                         {"many_inputs", (d.flags & TOFGRAPH_MANY_INPUTS) != 0},
                         {"ports", nlohmann::json::array()},
                         {"parameters", nlohmann::json::array()}};
  for (std::uint64_t i = 0; i < d.port_count; ++i) json["ports"].push_back(describe_port(d.ports[i]));
  for (std::uint64_t i = 0; i < d.parameter_count; ++i)
    json["parameters"].push_back(describe_parameter(d.parameters[i]));
  if (const tofgraph_effect* effect = effect_of(d)) {
    json["level"] = level_name(*effect);
    json["touches"] = effect->touches;
    json["confused_with"] = effect->confused_with;
    json["experiment"] = effect->experiment;
  }
  return json;
}

Catalogue::Catalogue(const std::vector<std::filesystem::path>& folders) {
  std::vector<std::filesystem::path> path = folders;
  std::ranges::copy(plugin_path_from_environment(), std::back_inserter(path));
  path.push_back(plugin_folder());
  for (const auto& folder : folders) {
    if (!std::filesystem::is_directory(folder))
      throw ConfigurationError(
          fmt::format("plugin path {}: error: this is no folder\n         a plugin path is the folder that holds "
                      "tofgraph_KIND_NAME.so",
                      folder.string()));
  }
  for (const auto& folder : path) {
    std::vector<PluginFile> found;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
      PluginFile file = plugin_file(entry.path());
      if (!file.kind.empty() && find(file.name) == nullptr) found.push_back(std::move(file));
    }
    std::ranges::sort(found, {}, &PluginFile::name);
    std::ranges::move(found, std::back_inserter(files_));
  }
}

std::vector<std::string> Catalogue::names() const {
  std::vector<std::string> names;
  for (const PluginFile& file : files_) {
    if (file.kind != "effect") names.push_back(file.name);
  }
  return names;
}

const PluginFile* Catalogue::find(const std::string& name) const {
  const auto found = std::ranges::find(files_, name, &PluginFile::name);
  return found == files_.end() ? nullptr : &*found;
}

const tofgraph_descriptor& Catalogue::load(const PluginFile& file,
                                           const std::map<std::string, nlohmann::json>& seen) const {
  const nlohmann::json& plugin = seen.at(file.path.string());
  if (plugin.contains("error")) throw PluginError(plugin.at("error").get<std::string>());
  return load_plugin(file);
}

}  // namespace tofgraph::core
