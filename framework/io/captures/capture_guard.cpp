// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/capture_guard.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdint>
#include <fstream>
#include <mutex>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

#include "config/child_process.hpp"

namespace tofgraph::io {
namespace {

/// Bytes of address space in use now.
std::size_t address_space() {
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

/// What changes with a file's content: device, inode, size, time of the last change in s and ns.
using Version = std::array<std::int64_t, 5>;

std::optional<Version> version_of(const std::filesystem::path& file) {
  struct stat now {};
  if (stat(file.c_str(), &now) != 0) return std::nullopt;
  return Version{static_cast<std::int64_t>(now.st_dev), static_cast<std::int64_t>(now.st_ino), now.st_size,
                 now.st_mtim.tv_sec, now.st_mtim.tv_nsec};
}

void limit(decltype(RLIMIT_AS) what, rlim_t value) {
  rlimit now{};
  getrlimit(what, &now);
  now.rlim_cur = std::min(value, now.rlim_max);
  setrlimit(what, &now);
}

}  // namespace

void set_limits(const TrialLimits& limits) {
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, limits.cpu_seconds);
  limit(RLIMIT_AS, address_space() + limits.memory);
}

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

void run_trial_once(const std::filesystem::path& file, std::vector<std::string> command) {
  static std::mutex mutex;
  static std::set<Version> passed;  // under the mutex
  const std::optional<Version> before = version_of(file);
  {
    const std::scoped_lock lock(mutex);
    if (before && passed.contains(*before)) return;
  }
  run_trial(std::move(command));
  const std::scoped_lock lock(mutex);
  if (before && before == version_of(file)) passed.insert(*before);
}

}  // namespace tofgraph::io
