// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Descriptors are read by a child process, so that a broken plugin crashes only that, and cached by path, size and
// time. Deleting the cache costs only the time of a scan.
#include "config/child_process.hpp"
#include "config/json_text.hpp"
#include "config/log.hpp"
#include "config/paths.hpp"
#include "graph/plugin.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <fstream>
#include <sstream>

namespace tofgraph::graph {
namespace {

using nlohmann::json;

/// Properties that a cached entry must match.
json fingerprint(const std::filesystem::path& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  const auto time = std::filesystem::last_write_time(path, error).time_since_epoch().count();
  return {{"size", size}, {"time", time}, {"api", fmt::format("{}.{}", TOFGRAPH_API_MAJOR, TOFGRAPH_API_MINOR)}};
}

std::filesystem::path cache_file() {
  const auto folder = config::cache_folder();
  return folder.empty() ? folder : folder / "plugins.json";
}

json read_cache() {
  std::ifstream in(cache_file());
  json cache = json::parse(in, nullptr, false);
  return cache.is_object() ? cache : json::object();
}

void write_cache(const json& cache) {
  if (cache_file().empty()) return;
  std::error_code error;
  std::filesystem::create_directories(config::cache_folder(), error);
  const auto temporary = fmt::format("{}.{}", cache_file().string(), getpid());
  {
    std::ofstream out(temporary);
    out << config::json_text(cache);
    if (!out.flush()) return;
  }
  std::filesystem::rename(temporary, cache_file(), error);
}

/// Checksum of a cache entry, which detects modified entries.
std::size_t check_number(const json& plugin) { return std::hash<std::string>()(config::json_text(plugin)); }

/// Cache entry for the file in its present state, or null. A damaged entry counts as missing.
const json* remembered(const json& cache, const std::filesystem::path& file) {
  const auto entry = cache.find(file.string());
  if (entry == cache.end() || !entry->is_object() || !entry->contains("plugin")) return nullptr;
  const json& plugin = entry->at("plugin");
  const bool whole =
      entry->value("key", json()) == fingerprint(file) && entry->value("check", json()) == json(check_number(plugin));
  return whole ? &plugin : nullptr;
}

std::string how_it_ended(const config::ChildResult& child) {
  if (child.signal == SIGALRM) return "did not return within 20 s";
  if (child.signal != 0)
    return fmt::format("crashed while it was being loaded (signal {}, {})", child.signal, strsignal(child.signal));
  return fmt::format("ended the process that loaded it (exit code {})", child.exit_code);
}

/// Runs the scanner over the files from `first` until it stops. Reports once if a plugin takes long.
config::ChildResult run_scanner(const std::vector<PluginFile>& files, std::size_t first) {
  std::vector<std::string> command = {config::scanner()};
  for (std::size_t i = first; i < files.size(); ++i) command.push_back(files[i].path.string());
  std::size_t told = SIZE_MAX;
  constexpr std::chrono::seconds patience{2};
  const auto tell = [&](const std::string& output) {
    const std::size_t loading = first + static_cast<std::size_t>(std::ranges::count(output, '\n'));
    if (loading >= files.size() || loading == told) return;
    config::print_message(
        fmt::format("plugin {}: still being loaded after {} s", files[loading].path.string(), patience.count()));
    told = loading;
  };
  try {
    return config::run_child(command, {.patience = patience, .on_silence = tell});
  } catch (const std::runtime_error& problem) {
    throw PluginError(fmt::format("cannot start the plugin scanner {}: {}", command.front(), problem.what()));
  }
}

}  // namespace

std::map<std::string, json> PluginRegistry::describe(const std::vector<PluginFile>& files) const {
  std::map<std::string, json> result;
  std::vector<PluginFile> unseen;
  json cache = read_cache();
  for (const PluginFile& file : files) {
    if (const Plugin* plugin = own(file))
      result[file.path.string()] = graph::describe(*plugin);
    else if (const json* known = remembered(cache, file.path))
      result[file.path.string()] = *known;
    else
      unseen.push_back(file);
  }
  for (std::size_t next = 0; next < unseen.size();) {
    const config::ChildResult child = run_scanner(unseen, next);
    std::istringstream lines(child.output);
    for (std::string line; next < unseen.size() && std::getline(lines, line) && !lines.eof();) {
      const json seen = json::parse(line, nullptr, false);
      result[unseen[next++].path.string()] = seen.is_object() ? seen : json{{"error", "the scanner said: " + line}};
    }
    if (next < unseen.size()) {
      const std::string path = unseen[next++].path.string();
      result[path] = {
          {"error", fmt::format("plugin {}: {}\n         it is ignored; fix it or remove it from the plugin path", path,
                                how_it_ended(child))}};
    }
  }
  for (const PluginFile& file : unseen) {  // not cached: the cause may lie outside the file
    const json& seen = result.at(file.path.string());
    if (seen.contains("error")) continue;
    cache[file.path.string()] = {{"key", fingerprint(file.path)}, {"check", check_number(seen)}, {"plugin", seen}};
  }
  if (!unseen.empty()) write_cache(cache);
  return result;
}

}  // namespace tofgraph::graph
