// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Atomically written files, and the names of a series of them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph::io {

/// File under a temporary name in the folder of its final one, until commit() renames it. Without a commit it is
/// removed. Two writers of the same final name do not disturb each other: the last commit wins.
class OutputFile {
 public:
  /// Creates parent folders and the empty temporary file. @throws std::runtime_error
  explicit OutputFile(std::filesystem::path final_path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  const std::filesystem::path& final_path() const { return final_; }
  /// Temporary path, for libraries that open files by name.
  const std::filesystem::path& temporary_path() const { return temporary_; }
  /// Appends. @throws std::runtime_error, e.g. if the disk is full
  void write(std::span<const std::byte> data);
  void write(std::string_view text) { write(std::as_bytes(std::span(text))); }

  /// Syncs the content to disk, so that commit() leaves a complete file even after a power failure.
  /// Takes milliseconds: for single files, not for one per frame. @throws std::runtime_error
  void sync();
  /// Renames the file to its final name, replacing an existing file. @throws std::runtime_error
  void commit();

 private:
  void close();
  [[noreturn]] void fail(const char* what, int error) const;

  std::filesystem::path final_, temporary_;
  int descriptor_ = -1;
};

/// Overwrites an existing file from its beginning. For files to which the host gave a temporary name.
class FileWriter {
 public:
  explicit FileWriter(std::filesystem::path path);  ///< @throws std::runtime_error
  ~FileWriter();
  FileWriter(const FileWriter&) = delete;
  FileWriter& operator=(const FileWriter&) = delete;
  /// @throws std::runtime_error, e.g. if the disk is full
  void write(std::span<const std::byte> data);
  void write(std::string_view text) { write(std::as_bytes(std::span(text))); }

 private:
  std::filesystem::path path_;
  int descriptor_;
};

/// Writes a complete file, synced. @throws std::runtime_error
void write_file(const std::filesystem::path& path, std::string_view content);

/// Path of an output, a single file or one per frame: "out/cloud_{frame:06}.pcd"; {frame} without leading zeros.
class OutputPattern {
 public:
  OutputPattern() = default;
  /// @throws std::runtime_error if braces are not {frame} or {frame:06}, are in a folder's name or occur twice
  explicit OutputPattern(const std::string& path) : OutputPattern(path, path) {}
  /// Resolved path of `written`, which is relative to some folder: braces in the resolved folders are not a pattern.
  /// @throws std::runtime_error as above
  OutputPattern(const std::filesystem::path& path, const std::string& written);
  /// Pattern of a single file with any name.
  static OutputPattern of_file(const std::filesystem::path& path);

  /// Returns true if there is one file per frame.
  bool numbered() const { return numbered_; }
  /// Pattern with _{frame:06} before the extension.
  OutputPattern with_number() const;
  /// Same pattern in another folder.
  OutputPattern in_folder(std::filesystem::path folder) const;
  const std::filesystem::path& folder() const { return folder_; }
  /// Pattern as text.
  std::string text() const;
  std::filesystem::path path(std::uint64_t frame) const;
  /// Single file beside the series, without the placeholder and the separators before it, with another extension:
  /// "out/cloud_{frame:06}.pcd" and ".provenance.json" give "out/cloud.provenance.json".
  std::filesystem::path companion(std::string_view extension) const;
  /// Returns true if a name can result from both patterns.
  bool overlaps(const OutputPattern& other) const;
  /// Existing files that match the pattern, sorted by name.
  std::vector<std::filesystem::path> members() const;
  /// First of the members, or an empty path.
  std::filesystem::path existing() const;

 private:
  bool produces(std::string_view name) const;

  std::filesystem::path folder_;
  std::string before_, after_;  // of the file name
  int digits_ = 0;
  bool numbered_ = false;
};

/// Reason why a file cannot be created at this path; empty: it can. The folder, or its nearest existing parent, is not
/// writable, or the path is a folder. Does not create anything.
std::string write_error(const std::filesystem::path& path);

/// Reason why an output would overwrite a file that is read at the same time; empty: it would not. Follows links.
std::string input_problem(const OutputPattern& pattern, std::span<const std::filesystem::path> inputs);
std::string input_problem(const std::filesystem::path& file, std::span<const std::filesystem::path> inputs);

/// Checks an output before the first frame. @returns reason why it is impossible; empty: none.
/// @param overwrite existing files may be replaced
std::string output_problem(const OutputPattern& pattern, bool overwrite);
/// @param allowed_by option by which the user can allow overwriting
std::string output_problem(const std::filesystem::path& file, bool overwrite,
                           std::string_view allowed_by = "--force or overwrite: true");

}  // namespace tofgraph::io
