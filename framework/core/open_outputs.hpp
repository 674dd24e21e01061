// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The files that the running call of a plugin has begun: they appear whole when it went well, or not at all.
#pragma once

#include "io/output_file.hpp"

#include <memory>
#include <string>
#include <vector>

namespace tofgraph::core {

class OpenOutputs {
 public:
  /// @param once a run: it is on the disk before it has its name, which costs milliseconds
  /// @returns the temporary name, which lives until the call is over. @throws std::runtime_error
  const char* open(const std::filesystem::path& path, bool once) {
    files_.push_back({std::make_unique<io::OutputFile>(path), once});
    return files_.back().file->temporary_path().c_str();
  }
  /// Gives all their final names. @throws std::runtime_error
  void commit() {
    if (files_.empty()) return;
    const std::vector<Open> files = std::move(files_);
    files_.clear();
    for (const Open& open : files) {
      if (open.once) open.file->sync();
      open.file->commit();
    }
  }
  /// Removes them. @param text where a temporary name is told, the final one will be
  void discard(std::string& text) {
    for (const Open& open : files_) {
      const std::string& temporary = open.file->temporary_path().string();
      if (const auto at = text.find(temporary); at != std::string::npos)
        text.replace(at, temporary.size(), open.file->final_path().string());
    }
    files_.clear();
  }

 private:
  struct Open {
    std::unique_ptr<io::OutputFile> file;
    bool once;
  };
  std::vector<Open> files_;
};

/// Those of this thread.
inline OpenOutputs& open_outputs() {
  thread_local OpenOutputs outputs;
  return outputs;
}

}  // namespace tofgraph::core
