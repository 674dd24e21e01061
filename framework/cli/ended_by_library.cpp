// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Handles libraries that end the program. Some vendors' libraries call exit(0) when a device or a licence is missing,
// which would look like success. The dynamic linker binds such calls of any library to the definitions here, because
// those of the program precede those of the C library. The end of main() does not use them.
#include "cli/commands.hpp"

#include <sys/syscall.h>
#include <unistd.h>

#include <cstdlib>

#include "graph/running_call.hpp"

namespace {

const pid_t program = getpid();

/// Ends the program with a message and the exit code for a failure. A forked child that has not yet called exec exits
/// with the requested code.
[[noreturn]] void end(const char* call, int code) {
  const bool child = getpid() != program;
  if (!child) tofgraph::graph::tell_ending(call, code);
  syscall(SYS_exit_group, child ? code : tofgraph::cli::failed);
  __builtin_unreachable();
}

}  // namespace

extern "C" {
__attribute__((visibility("default"))) void exit(int code) noexcept { end("exit", code); }
__attribute__((visibility("default"))) void quick_exit(int code) noexcept { end("quick_exit", code); }
__attribute__((visibility("default"))) void _Exit(int code) noexcept { end("_Exit", code); }
__attribute__((visibility("default"))) void _exit(int code) { end("_exit", code); }
}
