// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/capture_guard.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <utility>

#include "config/child_process.hpp"
#include "config/paths.hpp"

namespace tofgraph::io {
namespace {

/// Properties that change with a file's content: device, inode, size, time of the last change in s and ns.
using Version = std::array<std::int64_t, 5>;

std::optional<Version> version_of(const std::filesystem::path& file) {
  struct stat now {};
  if (stat(file.c_str(), &now) != 0) return std::nullopt;
  return Version{static_cast<std::int64_t>(now.st_dev), static_cast<std::int64_t>(now.st_ino), now.st_size,
                 now.st_mtim.tv_sec, now.st_mtim.tv_nsec};
}

/// Trials that files passed in this run, by kind.
class Passed {
 public:
  bool has(const std::string& kind, const Version& version) {
    const std::scoped_lock lock(mutex_);
    return trials_.contains({kind, version});
  }
  void add(const std::string& kind, const Version& version) {
    const std::scoped_lock lock(mutex_);
    trials_.insert({kind, version});
  }

 private:
  std::mutex mutex_;
  std::set<std::pair<std::string, Version>> trials_;
};

Passed& passed() {
  static Passed all;
  return all;
}

}  // namespace

void run_trial(std::vector<std::string> command) {
  const std::string program = command.front();
  config::ChildResult result;
  try {
    result = config::run_child(std::move(command), {.keep_errors = true});
  } catch (const std::runtime_error& problem) {
    throw std::runtime_error(fmt::format("cannot be tried: {} cannot be started: {}", program, problem.what()));
  }
  if (!result.output.empty()) throw std::runtime_error(result.output);
  if (result.ok()) return;
  constexpr std::array crashes = {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL};
  if (result.signal == SIGXCPU || std::ranges::find(crashes, result.signal) != crashes.end())
    throw std::runtime_error(fmt::format("is damaged: HDF5 {} when a child process tried to read it",
                                         result.signal == SIGXCPU ? "did not finish" : "crashed"));
  throw std::runtime_error(fmt::format(
      "cannot be tried: {} ended with {} {}{}{}", program, result.signal != 0 ? "signal" : "exit code",
      result.signal != 0 ? result.signal : result.exit_code, result.errors.empty() ? "" : ": ", result.errors));
}

void run_trial_once(const std::filesystem::path& file, const std::string& kind, std::vector<std::string> command) {
  const std::optional<Version> before = version_of(file);
  if (before && passed().has(kind, *before)) return;
  run_trial(std::move(command));
  if (before && before == version_of(file)) passed().add(kind, *before);
}

void try_ahead(const std::vector<std::filesystem::path>& files) {
  std::map<Version, std::filesystem::path> untried;  // by file identity, so that each file is tried once
  for (const std::filesystem::path& file : files) {
    std::error_code error;
    const std::optional<Version> version = version_of(file);
    if (version && std::filesystem::is_regular_file(file, error) && !passed().has(capture_trial, *version))
      untried.emplace(*version, file);
  }
  const std::vector<std::pair<Version, std::filesystem::path>> all(untried.begin(), untried.end());
  // Two programs per core balance the load; more would cost start-up time, as each loads its libraries.
  const std::size_t programs =
      std::min<std::size_t>(all.size(), 2UL * std::max(1U, std::thread::hardware_concurrency()));
  tbb::parallel_for(std::size_t{0}, programs, [&](std::size_t program) {
    std::vector<std::string> command = {config::trial_program(), "captures"};
    for (std::size_t i = program; i < all.size(); i += programs) command.push_back(all[i].second.string());
    config::ChildResult result;
    try {
      result = config::run_child(std::move(command), {.keep_errors = true});
    } catch (const std::runtime_error&) {
      return;  // reported when the file is read
    }
    std::istringstream numbers(result.output);
    for (std::size_t k = 0; numbers >> k;) {
      const std::size_t i = program + k * programs;
      if (i < all.size() && version_of(all[i].second) == all[i].first) passed().add(capture_trial, all[i].first);
    }
  });
}

}  // namespace tofgraph::io
