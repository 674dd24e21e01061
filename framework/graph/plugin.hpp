// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Plugins: found by file name without loading, checked in a process of their own, loaded when first used,
/// never unloaded.
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

/// A plugin that cannot be used; what() names the file, the reason and what to do.
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

/// A plugin that was loaded: its descriptor with all that it points to in the host's own sizes and without nulls, but
/// for defaults of parameters and the calls that may be absent.
struct Plugin : tofgraph_descriptor {
  Plugin() : tofgraph_descriptor{} {}
  Plugin(const Plugin&) = delete;
  Plugin& operator=(const Plugin&) = delete;

  PluginFile file;
  bool built_in = false;                    ///< comes with the program
  std::string hash;                         ///< SHA-256 of the code where that is not the file, or empty
  const tofgraph_effect* effect = nullptr;  ///< null: no effect
  const tofgraph_format* format = nullptr;  ///< null: no format
  std::vector<tofgraph_port> own_ports;
  std::vector<tofgraph_parameter> own_parameters;
  tofgraph_effect own_effect{};
  tofgraph_format own_format{};
};

/// Loads a library and checks its descriptor against the border's rules. The library stays loaded; what it prints
/// meanwhile goes to standard error. @throws PluginError
const Plugin& load_plugin(const PluginFile& file);

/// Fills a plugin in from the descriptor that a library gave. @throws PluginError naming the field that is wrong
void read_descriptor(const tofgraph_descriptor* given, Plugin& plugin);

/// The kind and name in a file's name; kind is empty when it is not a plugin's.
PluginFile plugin_file(const std::filesystem::path& path);

/// geometry, phasor, samples or taps.
const char* level_name(const tofgraph_effect& effect);

/// A descriptor as data: what `describe`, the schema and the documentation are made from.
nlohmann::json describe(const Plugin& plugin);

/// The folders that plugins are looked for in: those given, of TOFGRAPH_PLUGIN_PATH, the installed one. Absolute.
/// @param problem is told which folders of the environment are not there: a remark, as on another machine they may be
/// @throws ConfigurationError when a given one is not a folder that can be read
std::vector<std::filesystem::path> plugin_path(const std::vector<std::filesystem::path>& given,
                                               const std::function<void(const std::string&)>& problem = {});

/// Returns whether a plugin comes with the program: it lies in the installed folder and is in the list beside that.
bool is_built_in(const PluginFile& file);
/// From here on this process sees no plugin of others: `run --safe`.
void use_built_in_plugins_only();

/// The plugins of a search path.
class PluginRegistry {
 public:
  /// @param folders those given first win
  /// @param own plugins of this program itself, which win over all files; their paths differ from each other
  explicit PluginRegistry(const std::vector<std::filesystem::path>& folders, std::vector<const Plugin*> own = {});

  const std::vector<std::filesystem::path>& folders() const { return folders_; }
  const std::vector<PluginFile>& files() const { return files_; }
  /// Plugins that cannot be reached, as one of the same name stands before them: the hidden one, and what hides it.
  const std::vector<std::pair<PluginFile, PluginFile>>& hidden() const { return hidden_; }
  std::vector<std::string> names() const;
  /// The plugin of that name, or null.
  const PluginFile* find(const std::string& name) const;

  /// The descriptors of some plugins, read in child processes or taken from the cache; for a plugin that cannot be
  /// used {"error": text}. Keys are paths.
  std::map<std::string, nlohmann::json> describe(const std::vector<PluginFile>& files) const;

  /// Loads a plugin into this process after it proved harmless in another. @throws PluginError
  const Plugin& load(const PluginFile& file) const { return load(file, describe({file})); }
  /// The same of one of many. @param seen describe() of them all, which costs hardly more than of one
  const Plugin& load(const PluginFile& file, const std::map<std::string, nlohmann::json>& seen) const;

 private:
  const Plugin* own(const PluginFile& file) const;

  std::vector<std::filesystem::path> folders_;
  std::vector<const Plugin*> own_;
  std::vector<PluginFile> files_;
  std::vector<std::pair<PluginFile, PluginFile>> hidden_;
};

}  // namespace tofgraph::graph
