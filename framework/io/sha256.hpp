// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Hash of a file's content for the provenance.
#pragma once

#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>

namespace tofgraph::io {

/// SHA-256 of a file as hexadecimal digits.
/// @param stopped asked every few milliseconds; where it says so the result is empty
/// @throws std::runtime_error when the file cannot be read
std::string sha256_of_file(const std::filesystem::path& file, const std::function<bool()>& stopped = {});

/// SHA-256 of bytes in memory as hexadecimal digits.
std::string sha256_of(std::string_view bytes);

/// The hash of a file that may be long: made once, by the first who asks, while others wait. [any thread]
class FileHash {
 public:
  /// @throws std::runtime_error when the file cannot be read
  explicit FileHash(std::filesystem::path file);

  /// Empty when it was stopped, or the file is gone.
  const std::string& get(const std::function<bool()>& stopped = {}) const;

 private:
  std::filesystem::path file_;
  mutable std::once_flag made_;
  mutable std::string digits_;
};

}  // namespace tofgraph::io
