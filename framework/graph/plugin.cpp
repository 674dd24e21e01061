// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/plugin.hpp"

#include "config/architecture.hpp"
#include "config/diagnostics.hpp"
#include "config/paths.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <mutex>
#include <set>
#include <span>

#include <tofgraph/array.hpp>

namespace tofgraph::graph {
namespace {

[[noreturn]] void refuse(const PluginFile& file, const std::string& reason, const std::string& advice) {
  throw PluginError(fmt::format("plugin {}: {}\n         {}", file.path.string(), reason, advice));
}

/// Explains a dlopen error by naming the missing library or symbol.
[[noreturn]] void refuse_library(const PluginFile& file, const std::string& error) {
  if (const auto found = error.find("undefined symbol: "); found != std::string::npos) {
    refuse(file,
           fmt::format("needs the symbol '{}', which none of the libraries it was linked with defines",
                       error.substr(found + 18)),
           "link the library that defines it");
  }
  if (const auto found = error.find(": cannot open shared object file");
      found != std::string::npos && !error.starts_with(file.path.string())) {
    refuse(file, fmt::format("needs the library '{}', which is not installed", error.substr(0, found)),
           "install the package that has it, or set its folder in LD_LIBRARY_PATH");
  }
  if (const std::string other = config::other_architecture(file.path.string()); !other.empty())
    refuse(file, other, "build it for this machine");
  refuse(file, "cannot be loaded: " + error, "is it a shared library for this machine?");
}

/// Redirects standard output to standard error during its lifetime: a plugin's messages must not mix with data.
class OutputAside {
 public:
  OutputAside() {
    std::fflush(stdout);
    kept_ = dup(STDOUT_FILENO);
    if (kept_ >= 0) dup2(STDERR_FILENO, STDOUT_FILENO);
  }
  ~OutputAside() {
    std::fflush(stdout);
    if (kept_ < 0) return;
    dup2(kept_, STDOUT_FILENO);
    close(kept_);
  }
  OutputAside(const OutputAside&) = delete;
  OutputAside& operator=(const OutputAside&) = delete;

 private:
  int kept_ = -1;
};

/// Reason why plugins cannot be searched for in this folder; empty if they can.
std::string folder_problem(const std::filesystem::path& folder) {
  std::error_code error;
  const auto type = std::filesystem::status(folder, error).type();
  if (type == std::filesystem::file_type::directory) return {};
  const bool known = !error || type == std::filesystem::file_type::not_found;
  return known ? "is not a folder" : "cannot be entered: " + error.message();
}

std::atomic<bool> built_in_only{false};

/// Converts a bound to JSON: NaN ("no bound") becomes null.
nlohmann::json number_or_null(double value) { return std::isnan(value) ? nlohmann::json() : nlohmann::json(value); }

nlohmann::json describe_port(const tofgraph_port& port) {
  static constexpr const char* directions[] = {"", "in", "out", "inout"};
  nlohmann::json json = {{"name", port.name},
                         {"direction", directions[port.direction]},
                         {"channel", port.channel},
                         {"shape", port.shape},
                         {"type", element_name(port.type)},
                         {"unit", port.unit},
                         {"optional", (port.flags & TOFGRAPH_PORT_OPTIONAL) != 0},
                         {"text", port.text}};
  const std::pair<const char*, const char*> meanings[] = {
      {"needs", port.needs}, {"refuses", port.refuses}, {"from", port.from}, {"adds", port.adds}, {"of", port.of}};
  for (const auto& [key, words] : meanings) {
    if (*words != 0) json[key] = words;
  }
  return json;
}

nlohmann::json describe_parameter(const tofgraph_parameter& p) {
  static constexpr const char* kinds[] = {
      "",        "bool",       "integer",     "number",          "text",         "choice",
      "numbers", "input file", "output file", "file each frame", "input folder", "image"};
  nlohmann::json json = {{"name", p.name},
                         {"type", kinds[p.kind]},
                         {"unit", p.unit},
                         {"required", (p.flags & TOFGRAPH_PARAMETER_REQUIRED) != 0},
                         {"text", p.text},
                         {"default", p.default_value != nullptr ? nlohmann::json(p.default_value) : nlohmann::json()},
                         {"minimum", number_or_null(p.minimum)},
                         {"maximum", number_or_null(p.maximum)}};
  const bool file = p.kind == TOFGRAPH_KIND_OUTPUT_FILE || p.kind == TOFGRAPH_KIND_FRAME_FILES;
  if (*p.choices != 0) json[file ? "companions" : "choices"] = p.choices;
  if ((p.flags & TOFGRAPH_PARAMETER_LIVE) != 0) json["live"] = true;
  if ((p.flags & TOFGRAPH_PARAMETER_IN_PLACE) != 0) json["in_place"] = true;
  if ((p.flags & TOFGRAPH_PARAMETER_NESTED) != 0) json["nested"] = true;
  if (!std::isnan(p.off)) json["off"] = p.off;
  if (!std::isnan(p.typical)) json["typical"] = p.typical;
  return json;
}

}  // namespace

const char* level_name(const tofgraph_effect& effect) {
  static constexpr const char* names[] = {"", "geometry", "phasor", "samples", "taps"};
  return names[effect.level];
}

PluginFile plugin_file(const std::filesystem::path& path) {
  const std::string name = path.filename().string();
  for (const char* kind : {"source", "filter", "sink", "effect", "format"}) {
    const std::string prefix = fmt::format("tofgraph_{}_", kind);
    if (name.starts_with(prefix) && name.ends_with(".so") && name.size() > prefix.size() + 3) {
      return {kind, name.substr(prefix.size(), name.size() - prefix.size() - 3), path};
    }
  }
  return {};
}

const Plugin& load_plugin(const PluginFile& file) {
  static std::mutex mutex;
  static std::map<std::string, std::unique_ptr<const Plugin>> loaded;  // never unloaded
  const std::scoped_lock lock(mutex);
  if (const auto known = loaded.find(file.path.string()); known != loaded.end()) return *known->second;
  auto plugin = std::make_unique<Plugin>();
  plugin->file = file;
  plugin->built_in = is_built_in(file);
  const tofgraph_descriptor* descriptor = nullptr;
  {
    const OutputAside aside;
    void* library = dlopen(file.path.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    if (library == nullptr) refuse_library(file, dlerror());
    dlerror();
    void* symbol = dlsym(library, TOFGRAPH_PLUGIN_SYMBOL);
    if (symbol == nullptr) {
      refuse(file, "has no symbol '" TOFGRAPH_PLUGIN_SYMBOL "'",
             "a plugin exports it: write TOFGRAPH_STAGE(Class, \"text\") at the end of its file");
    }
    descriptor = reinterpret_cast<tofgraph_plugin_function>(symbol)();
  }
  read_descriptor(descriptor, *plugin);
  return *(loaded[file.path.string()] = std::move(plugin));
}

nlohmann::json describe(const Plugin& d) {
  nlohmann::json json = {{"kind", d.kind},
                         {"name", d.name},
                         {"summary", d.summary},
                         {"version", d.version},
                         {"author", d.author},
                         {"licence", d.licence},
                         {"file", d.file.path.string()},
                         {"api", fmt::format("{}.{}", d.api_major, d.api_minor)},
                         {"stateless", (d.flags & TOFGRAPH_STAGE_STATELESS) != 0},
                         {"steady", (d.flags & TOFGRAPH_STAGE_STEADY) != 0},
                         {"many_inputs", (d.flags & TOFGRAPH_STAGE_MANY_INPUTS) != 0},
                         {"ports", nlohmann::json::array()},
                         {"parameters", nlohmann::json::array()}};
  for (const tofgraph_port& port : d.own_ports) json["ports"].push_back(describe_port(port));
  for (const tofgraph_parameter& parameter : d.own_parameters)
    json["parameters"].push_back(describe_parameter(parameter));
  if (d.effect != nullptr) {
    json["level"] = level_name(*d.effect);
    json["belongs_to"] = d.effect->scope == TOFGRAPH_SCOPE_SETUP ? "set-up" : "camera";
    json["touches"] = d.effect->touches;
    json["confused_with"] = d.effect->confused_with;
    json["experiment"] = d.effect->experiment;
  }
  if (d.format != nullptr) json["endings"] = d.format->endings;
  return json;
}

std::vector<std::filesystem::path> plugin_path(const std::vector<std::filesystem::path>& given,
                                               const std::function<void(const std::string&)>& problem) {
  std::vector<std::filesystem::path> path;
  for (const auto& folder : given) {
    constexpr std::string_view advice = "a plugin path is the folder that holds tofgraph_KIND_NAME.so";
    const auto refuse_folder = [&](std::string_view why) {
      throw config::ConfigurationError(
          fmt::format("plugin path {}: error: this {}\n         {}", folder.string(), why, advice));
    };
    if (const std::string why = folder_problem(folder); !why.empty()) refuse_folder(why);
    if (access(folder.c_str(), R_OK | X_OK) != 0) refuse_folder("folder cannot be read");
    path.push_back(std::filesystem::absolute(folder).lexically_normal());
  }
  for (const auto& folder : config::plugin_path_from_environment()) {
    if (const std::string why = folder_problem(folder); problem && !why.empty())
      problem(fmt::format("TOFGRAPH_PLUGIN_PATH: {} {}", folder.string(), why));
    path.push_back(std::filesystem::absolute(folder));
  }
  std::error_code error;
  if (const auto local = config::local_plugin_folder(); std::filesystem::is_directory(local, error))
    path.push_back(local);
  path.push_back(config::plugin_folder());
  return path;
}

bool is_built_in(const PluginFile& file) {
  static const std::set<std::string> names = [] {
    std::set<std::string> lines;
    std::ifstream in(config::built_in_plugins());
    for (std::string line; std::getline(in, line);) lines.insert(line);
    return lines;
  }();
  std::error_code error;
  return names.contains(file.path.filename()) &&
         std::filesystem::equivalent(file.path.parent_path(), config::plugin_folder(), error);
}

void use_built_in_plugins_only() { built_in_only = true; }

PluginRegistry::PluginRegistry(const std::vector<std::filesystem::path>& folders, std::vector<const Plugin*> own)
    : folders_(folders), own_(std::move(own)) {
  for (const Plugin* plugin : own_) files_.push_back(plugin->file);
  for (const auto& folder : folders_) {
    std::vector<PluginFile> found;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
      PluginFile file = plugin_file(entry.path());
      if (file.kind.empty() || (built_in_only && !is_built_in(file))) continue;
      const PluginFile* before = find(file.name);
      if (before == nullptr)
        found.push_back(std::move(file));
      else if (!std::filesystem::equivalent(before->path, file.path, error))
        hidden_.emplace_back(std::move(file), *before);
    }
    std::ranges::sort(found, {}, &PluginFile::name);
    std::ranges::move(found, std::back_inserter(files_));
  }
}

std::vector<std::string> PluginRegistry::names() const {
  std::vector<std::string> names;
  for (const PluginFile& file : files_) {
    if (file.is_stage()) names.push_back(file.name);
  }
  return names;
}

const PluginFile* PluginRegistry::find(const std::string& name) const {
  const auto found = std::ranges::find(files_, name, &PluginFile::name);
  return found == files_.end() ? nullptr : &*found;
}

const Plugin* PluginRegistry::own(const PluginFile& file) const {
  const auto found = std::ranges::find_if(own_, [&](const Plugin* plugin) { return plugin->file.path == file.path; });
  return found == own_.end() ? nullptr : *found;
}

const Plugin& PluginRegistry::load(const PluginFile& file, const std::map<std::string, nlohmann::json>& seen) const {
  if (const Plugin* plugin = own(file)) return *plugin;
  const nlohmann::json& plugin = seen.at(file.path.string());
  if (plugin.contains("error")) throw PluginError(plugin.at("error").get<std::string>());
  return load_plugin(file);
}

}  // namespace tofgraph::graph
