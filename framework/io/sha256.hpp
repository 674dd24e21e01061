// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Hash of file contents for the provenance.
#pragma once

#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>

namespace tofgraph::io {

/// SHA-256 of a file as hexadecimal digits.
/// @param stopped polled every few milliseconds; if it returns true the result is empty
/// @throws std::runtime_error if the file cannot be read
std::string sha256_of_file(const std::filesystem::path& file, const std::function<bool()>& stopped = {});

/// SHA-256 of bytes in memory as hexadecimal digits.
std::string sha256_of(std::string_view bytes);

/// Hash of a possibly long file: computed once, by the first caller, while other callers wait. [any thread]
class FileHash {
 public:
  /// @throws std::runtime_error if the file cannot be read
  explicit FileHash(std::filesystem::path file);

  /// Hexadecimal digits; empty if it was stopped or the file no longer exists.
  const std::string& get(const std::function<bool()>& stopped = {}) const;

 private:
  std::filesystem::path file_;
  mutable std::once_flag made_;
  mutable std::string digits_;
};

}  // namespace tofgraph::io
