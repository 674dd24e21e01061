// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "config/process_limits.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

namespace tofgraph::config {
namespace {

/// Address space in use, bytes.
std::size_t address_space() {
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

void limit(decltype(RLIMIT_AS) what, rlim_t value) {
  rlimit now{};
  getrlimit(what, &now);
  now.rlim_cur = std::min(value, now.rlim_max);
  setrlimit(what, &now);
}

}  // namespace

void limit_process(const ProcessLimits& limits) {
  limit(RLIMIT_CORE, 0);
  if (limits.cpu_seconds) limit(RLIMIT_CPU, *limits.cpu_seconds);
  limit(RLIMIT_AS, address_space() + limits.memory);
}

}  // namespace tofgraph::config
