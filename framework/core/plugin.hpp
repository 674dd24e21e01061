// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Plugins: found by file name without loading, checked in a process of their own, loaded when first used,
/// never unloaded.
#pragma once

#include <tofgraph/plugin.h>

#include <nlohmann/json.hpp>

#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace tofgraph::core {

/// A plugin that cannot be used; what() names the file, the reason and what to do.
class PluginError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A file `tofgraph_KIND_NAME.so`.
struct PluginFile {
  std::string kind, name;
  std::filesystem::path path;
};

/// Loads a library and checks its descriptor against the border's rules. The library stays loaded.
/// @throws PluginError
const tofgraph_descriptor& load_plugin(const PluginFile& file);

/// The kind and name in a file's name; kind is empty when it is no plugin's.
PluginFile plugin_file(const std::filesystem::path& path);

/// What makes a plugin an effect; null for a stage.
const tofgraph_effect* effect_of(const tofgraph_descriptor& descriptor);

/// geometry, phasor, samples or taps.
const char* level_name(const tofgraph_effect& effect);

/// A descriptor as data: what `describe`, the schema and the documentation are made from.
nlohmann::json describe(const tofgraph_descriptor& descriptor);

/// The plugins of a search path.
class Catalogue {
 public:
  /// Folders given first win; those of TOFGRAPH_PLUGIN_PATH and the installed one follow.
  /// @throws ConfigurationError when a given one is no folder
  explicit Catalogue(const std::vector<std::filesystem::path>& folders);

  const std::vector<PluginFile>& files() const { return files_; }
  std::vector<std::string> names() const;
  /// The plugin of that name, or null.
  const PluginFile* find(const std::string& name) const;

  /// The descriptors of some plugins, read in child processes or taken from the cache; for a plugin that cannot be
  /// used {"error": text}. Keys are paths.
  std::map<std::string, nlohmann::json> describe(const std::vector<PluginFile>& files) const;

  /// Loads a plugin into this process after it proved harmless in another. @throws PluginError
  const tofgraph_descriptor& load(const PluginFile& file) const { return load(file, describe({file})); }
  /// The same of one of many. @param seen describe() of them all, which costs hardly more than of one
  const tofgraph_descriptor& load(const PluginFile& file, const std::map<std::string, nlohmann::json>& seen) const;

 private:
  std::vector<PluginFile> files_;
};

}  // namespace tofgraph::core
