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

/// A file that cannot be read or used; what() is a whole message.
class ForeignError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The format plugins of a run.
class Formats {
 public:
  explicit Formats(const graph::PluginRegistry& registry);
  /// The format that recognises a file's first bytes; null: none.
  const graph::Plugin* find(const std::vector<std::uint8_t>& head) const;
  /// Usual endings of all formats, for messages.
  std::string endings() const;

 private:
  std::vector<const graph::Plugin*> formats_;
};

/// An opened file. Reads of one file are made by one thread at a time.
class ForeignFile {
 public:
  /// Opens a file by the format whose plugin recognises its first bytes.
  /// @throws ForeignError a file that cannot be read, that no format recognises, or that is damaged
  ForeignFile(const Formats& formats, std::filesystem::path file);

  /// A file without a header, whose arrays a layout describes.
  ForeignFile(std::filesystem::path file, std::shared_ptr<FileFormat> own);

  const std::filesystem::path& path() const { return path_; }
  /// Name of the format's plugin.
  const std::string& format() const { return format_; }
  /// True where a layout describes the arrays; the frame axis before their own is added.
  bool is_headerless() const { return own_ != nullptr; }
  const std::vector<FileArray>& arrays() const { return arrays_; }
  /// A camera profile (YAML) that follows from the file; empty: none.
  const std::string& profile() const { return profile_; }
  /// Index of an array. @throws ForeignError with the names that exist
  std::size_t find(const std::string& name) const;
  /// Elements first .. first + count - 1 of an array's slowest axis. @throws ForeignError
  void read(std::size_t array, std::uint64_t first, std::uint64_t count, void* out) const;

 private:
  std::filesystem::path path_;
  std::string format_, profile_;
  std::shared_ptr<FileFormat> own_;
  std::vector<FileArray> arrays_;
  const tofgraph_format* border_ = nullptr;
  std::shared_ptr<void> file_;
};

/// Size of an element in words: "uint16", "float64".
std::string element_text(const FileArray& array);
/// Extents as people who use the format write them: "204 x 204".
std::string shape_text(const FileArray& array);
/// The extents in that order.
std::vector<std::uint64_t> shape_of(const FileArray& array);

}  // namespace tofgraph::foreign
