// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A file of another program, opened by the format plugin that recognises its content.
#pragma once

#include "graph/plugin.hpp"

#include <tofgraph/file_format.hpp>

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace tofgraph::foreign {

/// Error of a file that cannot be read or used; what() is a complete message.
class ForeignError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Format plugins available in a run.
class Formats {
 public:
  explicit Formats(const graph::PluginRegistry& registry);
  /// Returns the format that recognises the first bytes of a file, or null.
  const graph::Plugin* find(const std::vector<std::uint8_t>& head) const;
  /// Usual file name extensions of all formats, for messages.
  std::string endings() const;

 private:
  std::vector<const graph::Plugin*> formats_;
};

/// Open file of another program. Only one thread at a time may read from it.
class ForeignFile {
 public:
  /// Opens a file with the format plugin that recognises its first bytes.
  /// @throws ForeignError if it cannot be read, no format recognises it, or it is damaged
  ForeignFile(const Formats& formats, std::filesystem::path file);

  /// Opens a file without a header, whose arrays a layout describes.
  ForeignFile(std::filesystem::path file, std::shared_ptr<FileFormat> own);

  const std::filesystem::path& path() const { return path_; }
  /// Name of the format's plugin.
  const std::string& format() const { return format_; }
  /// Returns true if a layout describes the arrays; a frame axis then precedes the axes of the layout.
  bool is_headerless() const { return own_ != nullptr; }
  const std::vector<FileArray>& arrays() const { return arrays_; }
  /// Camera profile (YAML) derived from the file; empty: none.
  const std::string& profile() const { return profile_; }
  /// Returns the index of an array. @throws ForeignError listing the existing names
  std::size_t find(const std::string& name) const;
  /// Reads elements first .. first + count - 1 along the slowest axis of an array. @throws ForeignError
  void read(std::size_t array, std::uint64_t first, std::uint64_t count, void* out) const;

 private:
  std::filesystem::path path_;
  std::string format_, profile_;
  std::shared_ptr<FileFormat> own_;
  std::vector<FileArray> arrays_;
  const tofgraph_format* border_ = nullptr;
  std::shared_ptr<void> file_;
};

/// Type of an element as text: "uint16", "float64".
std::string element_text(const FileArray& array);
/// Extents in the notation of the format: "204 x 204".
std::string shape_text(const FileArray& array);
/// Extents in the same order.
std::vector<std::uint64_t> shape_of(const FileArray& array);

}  // namespace tofgraph::foreign
