// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "config/paths.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>

namespace tofgraph::config {
namespace {

/// Folder that contains bin, lib and share: two levels above this library.
std::filesystem::path prefix() {
  Dl_info info{};
  if (dladdr(reinterpret_cast<const void*>(&plugin_folder), &info) == 0) return {};
  const auto library = std::filesystem::weakly_canonical(info.dli_fname);
  auto folder = library.parent_path();
  while (folder.has_filename() && folder.filename() != "lib") folder = folder.parent_path();  // lib/x86_64-linux-gnu
  return folder.parent_path();
}

}  // namespace

std::filesystem::path library_folder() {
  Dl_info info{};
  dladdr(reinterpret_cast<const void*>(&plugin_folder), &info);
  return std::filesystem::weakly_canonical(info.dli_fname).parent_path() / "tofgraph";
}

std::filesystem::path plugin_folder() { return library_folder() / "plugins"; }
std::filesystem::path local_plugin_folder() {
  const auto folder = plugin_folder().lexically_relative("/usr");
  return prefix() == "/usr" ? "/usr/local" / folder : std::filesystem::path{};
}
std::filesystem::path built_in_plugins() { return library_folder() / "built_in_plugins.txt"; }
std::filesystem::path command_folder() { return library_folder() / "commands"; }
std::filesystem::path scanner() { return library_folder() / "tofgraph-scan"; }
std::filesystem::path checker() { return library_folder() / "tofgraph-check"; }
std::filesystem::path trial_program() { return library_folder() / "tofgraph-probe"; }
std::filesystem::path profile_folder() { return prefix() / "share" / "tofgraph" / "profiles"; }

std::filesystem::path template_folder() { return prefix() / "share" / "tofgraph" / "templates"; }

std::filesystem::path cache_folder() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache == '/') {
    return std::filesystem::path(cache) / "tofgraph";
  }
  const char* home = std::getenv("HOME");
  return home != nullptr && *home == '/' ? std::filesystem::path(home) / ".cache" / "tofgraph"
                                         : std::filesystem::path{};
}

std::vector<std::filesystem::path> plugin_path_from_environment() {
  const char* path = std::getenv("TOFGRAPH_PLUGIN_PATH");
  return split_path(path != nullptr ? path : "");
}

std::string lower_case_ending(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

std::string joined_path(const std::vector<std::filesystem::path>& folders) {
  std::string path;
  for (const auto& folder : folders) {
    if (!path.empty()) path += ':';
    path += folder.string();
  }
  return path;
}

std::vector<std::filesystem::path> split_path(std::string_view rest) {
  std::vector<std::filesystem::path> folders;
  while (!rest.empty()) {
    const auto end = std::min(rest.find(':'), rest.size());
    if (end > 0) folders.emplace_back(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return folders;
}

}  // namespace tofgraph::config
