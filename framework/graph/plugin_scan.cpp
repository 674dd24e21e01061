// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Descriptors are read by a child process, so that a broken plugin takes nothing down, and remembered by path, size
// and time. Deleting the cache costs nothing but the time of a scan.
#include "config/paths.hpp"
#include "graph/plugin.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <fstream>

extern char** environ;  // NOLINT(readability-redundant-declaration)

namespace tofgraph::graph {
namespace {

using nlohmann::json;

/// What a cached entry must agree with.
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
    out << cache.dump();
    if (!out.flush()) return;
  }
  std::filesystem::rename(temporary, cache_file(), error);
}

/// Found again in an entry whose content nobody changed.
std::size_t check_number(const json& plugin) { return std::hash<std::string>()(plugin.dump()); }

/// What the cache knows of the file as it is now, or null. An entry that is damaged is one that is not there.
const json* remembered(const json& cache, const std::filesystem::path& file) {
  const auto entry = cache.find(file.string());
  if (entry == cache.end() || !entry->is_object() || !entry->contains("plugin")) return nullptr;
  const json& plugin = entry->at("plugin");
  const bool whole =
      entry->value("key", json()) == fingerprint(file) && entry->value("check", json()) == json(check_number(plugin));
  return whole ? &plugin : nullptr;
}

std::string how_it_ended(int status) {
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) return "did not come back within 20 s";
  if (WIFSIGNALED(status))
    return fmt::format("crashed while it was loaded (signal {}, {})", WTERMSIG(status), strsignal(WTERMSIG(status)));
  return fmt::format("ended the process that loaded it (exit code {})", WEXITSTATUS(status));
}

/// What the scanner writes, to its end. Says once of a plugin that it takes long.
std::string read_all(int end, const std::vector<PluginFile>& files, std::size_t first) {
  constexpr int patience_ms = 2000;
  std::string text;
  std::size_t told = SIZE_MAX;
  char block[4096];
  while (true) {
    const auto loading = first + static_cast<std::size_t>(std::ranges::count(text, '\n'));
    const bool tell = loading < files.size() && loading != told;
    pollfd waits{end, POLLIN, 0};
    const int ready = poll(&waits, 1, tell ? patience_ms : -1);
    if (ready == 0) {
      fmt::print(stderr, "plugin {}: still being loaded after {} s\n", files[loading].path.string(),
                 patience_ms / 1000);
      told = loading;
    } else if (ready > 0) {
      const ssize_t n = read(end, block, sizeof block);
      if (n <= 0) return text;
      text.append(block, static_cast<std::size_t>(n));
    } else if (errno != EINTR) {
      return text;
    }
  }
}

/// Runs the scanner over files; gives the lines that it wrote before it ended.
std::vector<std::string> run_scanner(const std::vector<PluginFile>& files, std::size_t first, int& status) {
  std::vector<std::string> words = {config::scanner().string()};
  for (std::size_t i = first; i < files.size(); ++i) words.push_back(files[i].path.string());
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);

  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0)
    throw PluginError(fmt::format("cannot start the plugin scanner: {}", std::strerror(errno)));
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], 3);
  posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);  // what a plugin prints is not data
  pid_t child = 0;
  const int failed = posix_spawn(&child, words[0].c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  if (failed != 0) {
    close(ends[0]);
    throw PluginError(fmt::format("cannot start the plugin scanner {}: {}", words[0], std::strerror(failed)));
  }
  const std::string text = read_all(ends[0], files, first);
  close(ends[0]);
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  std::vector<std::string> lines;
  for (std::size_t begin = 0, end = 0; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
    lines.push_back(text.substr(begin, end - begin));
  }
  return lines;
}

}  // namespace

std::map<std::string, json> PluginRegistry::describe(const std::vector<PluginFile>& files) const {
  std::map<std::string, json> result;
  std::vector<PluginFile> unseen;
  json cache = read_cache();
  for (const PluginFile& file : files) {
    if (const json* plugin = remembered(cache, file.path))
      result[file.path.string()] = *plugin;
    else
      unseen.push_back(file);
  }
  for (std::size_t next = 0; next < unseen.size();) {
    int status = 0;
    for (const std::string& line : run_scanner(unseen, next, status)) {
      if (next == unseen.size()) break;
      const json seen = json::parse(line, nullptr, false);
      result[unseen[next++].path.string()] = seen.is_object() ? seen : json{{"error", "the scanner said: " + line}};
    }
    if (next < unseen.size()) {
      const std::string path = unseen[next++].path.string();
      result[path] = {
          {"error", fmt::format("plugin {}: {}\n         it is left out; mend it or take it out of the plugin path",
                                path, how_it_ended(status))}};
    }
  }
  for (const PluginFile& file : unseen) {  // a refusal is not remembered: its cause may be outside the file
    const json& seen = result.at(file.path.string());
    if (seen.contains("error")) continue;
    cache[file.path.string()] = {{"key", fingerprint(file.path)}, {"check", check_number(seen)}, {"plugin", seen}};
  }
  if (!unseen.empty()) write_cache(cache);
  return result;
}

}  // namespace tofgraph::graph
