// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/captures/capture_guard.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <new>
#include <stdexcept>
#include <string>

namespace tofgraph::io {
namespace {

/// Bytes of address space in use now.
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

void write_all(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = write(descriptor, text.data(), text.size());
    if (written <= 0) return;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

std::string read_all(int descriptor) {
  std::string text;
  char block[1024];
  for (;;) {
    const ssize_t length = read(descriptor, block, sizeof block);
    if (length < 0 && errno == EINTR) continue;
    if (length <= 0) return text;
    text.append(block, static_cast<std::size_t>(length));
  }
}

/// @param wall_seconds after which it waits for what will not come
[[noreturn]] void child(const TrialLimits& limits, unsigned wall_seconds, const std::function<void()>& work,
                        int answer) {
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, limits.cpu_seconds);
  signal(SIGALRM, SIG_DFL);
  alarm(wall_seconds);
  limit(RLIMIT_AS, address_space() + limits.memory);
  if (const int nowhere = open("/dev/null", O_WRONLY); nowhere >= 0) dup2(nowhere, STDERR_FILENO);
  try {
    work();
  } catch (const std::bad_alloc&) {
    write_all(answer, "asks for more memory than any frame needs: the file is damaged");
  } catch (const std::exception& problem) {
    write_all(answer, problem.what());
  }
  _exit(0);  // nothing of the parent's is ended here
}

}  // namespace

namespace {

/// @returns the signal that ended the child, 0 for none
int try_once(const TrialLimits& limits, unsigned wall_seconds, const std::function<void()>& work) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error(std::string("no pipe: ") + std::strerror(errno));
  const pid_t pid = fork();
  if (pid == 0) {
    close(ends[0]);
    child(limits, wall_seconds, work, ends[1]);
  }
  const int error = errno;
  close(ends[1]);
  const std::string problem = pid > 0 ? read_all(ends[0]) : "";
  close(ends[0]);
  if (pid < 0) throw std::runtime_error(std::string("no child process: ") + std::strerror(error));
  int status = 0;
  while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  if (!problem.empty()) throw std::runtime_error(problem);
  if (WIFEXITED(status)) return WEXITSTATUS(status) == 0 ? 0 : SIGABRT;
  return WTERMSIG(status);
}

}  // namespace

void try_in_child(const TrialLimits& limits, const std::function<void()>& work) {
  // A child of a threaded process may wait for a lock that nobody holds any more, which says nothing about the file:
  // only one that computes without end does.
  int signal = SIGALRM;
  for (unsigned wall_seconds = limits.cpu_seconds; signal == SIGALRM && wall_seconds <= 8 * limits.cpu_seconds;
       wall_seconds *= 2)
    signal = try_once(limits, wall_seconds, work);
  if (signal == 0) return;
  throw std::runtime_error(fmt::format("is damaged: HDF5 {} when a child process tried to read it",
                                       signal == SIGXCPU || signal == SIGALRM ? "found no end" : "crashed"));
}

}  // namespace tofgraph::io
