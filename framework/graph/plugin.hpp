// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Plugins: found by file name without loading, checked in a separate process, loaded on first use, never
/// unloaded.
#pragma once

#include <tofgraph/effect.h>
#include <tofgraph/format.h>

#include <nlohmann/json.hpp>

#include <filesystem>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace tofgraph::graph {

/// Plugin that cannot be used; what() names the file, the reason and the remedy.
class PluginError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A file `tofgraph_KIND_NAME.so`.
struct PluginFile {
  std::string kind, name;
  std::filesystem::path path;

  /// Source, filter or sink: a node of a pipeline.
  bool is_stage() const { return kind == "source" || kind == "filter" || kind == "sink"; }
};

/// Loaded plugin: its descriptor copied to the host's struct sizes and without null pointers, except for defaults of
/// parameters and optional calls.
struct Plugin : tofgraph_descriptor {
  Plugin() : tofgraph_descriptor{} {}
  Plugin(const Plugin&) = delete;
  Plugin& operator=(const Plugin&) = delete;

  PluginFile file;
  bool built_in = false;                    ///< part of the installation
  std::string hash;                         ///< SHA-256 of the code if it is not the file's, or empty
  const tofgraph_effect* effect = nullptr;  ///< null: not an effect
  const tofgraph_format* format = nullptr;  ///< null: not a format
  std::vector<tofgraph_port> own_ports;
  std::vector<tofgraph_parameter> own_parameters;
  tofgraph_effect own_effect{};
  tofgraph_format own_format{};
};

/// Loads a library and checks its descriptor against the rules of the plugin interface. The library stays loaded; its
/// output meanwhile goes to standard error. @throws PluginError
const Plugin& load_plugin(const PluginFile& file);

/// Fills in a plugin from a library's descriptor. @throws PluginError naming the invalid field
void read_descriptor(const tofgraph_descriptor* given, Plugin& plugin);

/// Kind and name in a file name; the kind is empty if the file is not a plugin.
PluginFile plugin_file(const std::filesystem::path& path);

/// geometry, phasor, samples or taps.
const char* level_name(const tofgraph_effect& effect);

/// Descriptor as JSON: the source for `describe`, the schema and the documentation.
nlohmann::json describe(const Plugin& plugin);

/// Plugin folders in search order: the given ones, those of TOFGRAPH_PLUGIN_PATH, the installed one. Absolute paths.
/// @param problem receives a note on missing folders of the environment variable: they may exist on another machine
/// @throws ConfigurationError if a given folder cannot be read
std::vector<std::filesystem::path> plugin_path(const std::vector<std::filesystem::path>& given,
                                               const std::function<void(const std::string&)>& problem = {});

/// Returns whether a plugin belongs to the installation: it is in the installed folder and in the list next to it.
bool is_built_in(const PluginFile& file);
/// Excludes third-party plugins from this process: `run --safe`.
void use_built_in_plugins_only();

/// Plugins of a search path.
class PluginRegistry {
 public:
  /// @param folders earlier ones take precedence
  /// @param own plugins built into this program, which take precedence over all files; their paths are distinct
  explicit PluginRegistry(const std::vector<std::filesystem::path>& folders, std::vector<const Plugin*> own = {});

  const std::vector<std::filesystem::path>& folders() const { return folders_; }
  const std::vector<PluginFile>& files() const { return files_; }
  /// Plugins hidden by one of the same name earlier in the path: the hidden one and the one that hides it.
  const std::vector<std::pair<PluginFile, PluginFile>>& hidden() const { return hidden_; }
  std::vector<std::string> names() const;
  /// Returns the plugin of that name, or null.
  const PluginFile* find(const std::string& name) const;

  /// Descriptors of plugins, read in child processes or from the cache; {"error": text} for an unusable plugin. Keys
  /// are paths.
  std::map<std::string, nlohmann::json> describe(const std::vector<PluginFile>& files) const;

  /// Loads a plugin into this process after another process has loaded it safely. @throws PluginError
  const Plugin& load(const PluginFile& file) const { return load(file, describe({file})); }
  /// As above for one of many plugins. @param seen describe() of all of them, which costs hardly more than of one
  const Plugin& load(const PluginFile& file, const std::map<std::string, nlohmann::json>& seen) const;

 private:
  const Plugin* own(const PluginFile& file) const;

  std::vector<std::filesystem::path> folders_;
  std::vector<const Plugin*> own_;
  std::vector<PluginFile> files_;
  std::vector<std::pair<PluginFile, PluginFile>> hidden_;
};

}  // namespace tofgraph::graph
