// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// tofgraph-probe capture FILE END, tofgraph-probe map FILE DATASET, tofgraph-probe arrays FILE: reads untrusted files
// and writes what is wrong to standard output. If HDF5 crashes or loops, only this dies. tofgraph-probe captures
// FILE...: each in a process of its own, which is cheap here; writes the numbers of those that can be read, counted
// from 0.
#include "io/captures/array_file.hpp"
#include "io/captures/capture.hpp"
#include "io/captures/capture_map.hpp"

#include <sys/wait.h>

#include <unistd.h>
#include <cstdio>
#include <new>
#include <string>

namespace {

bool can_be_read(const char* file) {
  const pid_t child = fork();
  if (child == 0) {
    try {
      tofgraph::io::CaptureReader::read_on_trial(file);
      _exit(0);
    } catch (...) {
      _exit(1);
    }
  }
  int status = 1;
  return child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string kind = argc > 2 ? argv[1] : "";
  try {
    if (kind == "capture" && argc == 4)
      tofgraph::io::CaptureReader::read_on_trial(argv[2], std::stoull(argv[3]));
    else if (kind == "captures")
      for (int i = 2; i < argc; ++i) {
        if (can_be_read(argv[i])) std::printf("%d ", i - 2);
      }
    else if (kind == "arrays" && argc == 3)
      tofgraph::io::ArrayFile::read_on_trial(argv[2]);
    else if (kind == "map" && argc == 4)
      tofgraph::io::read_pixel_map_on_trial(argv[2], argv[3]);
    else
      _exit(2);
  } catch (const std::bad_alloc&) {
    std::fputs("asks for more memory than any frame needs: the file is damaged", stdout);
  } catch (const std::exception& problem) {
    std::fputs(problem.what(), stdout);
  }
  _exit(std::fflush(stdout) == 0 ? 0 : 1);  // nothing is left to be done
}
