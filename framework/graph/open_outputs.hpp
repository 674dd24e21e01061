// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Output files begun by the running call of a plugin: they appear complete on success, or not at all.
#pragma once

#include "io/output_file.hpp"

#include <memory>
#include <string>
#include <vector>

namespace tofgraph::graph {

class OpenOutputs {
 public:
  /// @param once written once per run: synced to disk before it is renamed, which costs milliseconds
  /// @returns the temporary name, valid until the call ends. @throws std::runtime_error
  const char* open(const std::filesystem::path& path, bool once) {
    files_.push_back({std::make_unique<io::OutputFile>(path), once});
    return files_.back().file->temporary_path().c_str();
  }
  /// Renames all to their final names. @throws std::runtime_error
  void commit() {
    if (files_.empty()) return;
    const std::vector<Open> files = std::move(files_);
    files_.clear();
    for (const Open& open : files) {
      if (open.once) open.file->sync();
      open.file->commit();
    }
  }
  /// Replaces temporary names in a text by the final ones.
  void name_finally(std::string& text) const {
    for (const Open& open : files_) {
      const std::string& temporary = open.file->temporary_path().string();
      if (const auto at = text.find(temporary); at != std::string::npos)
        text.replace(at, temporary.size(), open.file->final_path().string());
    }
  }
  bool accepting() const { return accepting_; }

 private:
  struct Open {
    std::unique_ptr<io::OutputFile> file;
    bool once;
  };
  friend class OutputScope;
  std::vector<Open> files_;
  bool accepting_ = false;
};

/// Open outputs of this thread.
inline OpenOutputs& open_outputs() {
  thread_local OpenOutputs outputs;
  return outputs;
}

/// Scope of a call in which outputs may be begun; those not committed at its end are removed.
class OutputScope {
 public:
  OutputScope() { open_outputs().accepting_ = true; }
  ~OutputScope() {
    open_outputs().accepting_ = false;
    open_outputs().files_.clear();
  }
  OutputScope(const OutputScope&) = delete;
  OutputScope& operator=(const OutputScope&) = delete;
  void commit() const { open_outputs().commit(); }
  void name_finally(std::string& text) const { open_outputs().name_finally(text); }
};

}  // namespace tofgraph::graph
