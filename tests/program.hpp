// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Runs the program as a user does, and returns its output; a folder of its own for each test.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <unistd.h>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace tofgraph::tests {

struct Outcome {
  int exit_code = -1;
  std::string out, err;
};

inline std::string read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void write_text(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

/// A folder that exists as long as the object.
class TemporaryFolder {
 public:
  explicit TemporaryFolder(const std::filesystem::path& where = std::filesystem::temp_directory_path()) {
    std::string pattern = (where / "tofgraph-test-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Runs a shell command line in which $TOFGRAPH is the program; stages of the fixtures are available.
inline Outcome shell(const std::string& command, const std::filesystem::path& folder) {
  const TemporaryFolder scratch;
  const std::string out = (scratch.path() / "out").string(), err = (scratch.path() / "err").string();
  const std::string line = "cd '" + folder.string() +
                           "' && export TOFGRAPH='" TOFGRAPH_PROGRAM "' TOFGRAPH_PLUGIN_PATH='" TOFGRAPH_BINARY_DIR
                           "/tests/plugins' XDG_CACHE_HOME='" TOFGRAPH_BINARY_DIR "/tests/cache'; (" +
                           command + ") >'" + out + "' 2>'" + err + "' </dev/null";
  const int status = std::system(line.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_text(out), read_text(err)};
}

/// For shell(): waits until a sink `collect` has created its file, however long the program takes to start.
inline std::string once_it_writes(const std::string& file) {
  return "until [ -e " + file + ".part ]; do sleep 0.05; done; ";
}

/// For shell(): waits until err.txt contains the words, at most for a minute.
inline std::string once_it_says(const std::string& words) {
  return "for i in $(seq 1200); do grep -q '" + words + "' err.txt && break; sleep 0.05; done; ";
}

}  // namespace tofgraph::tests
