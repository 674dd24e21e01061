// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Files that appear whole or not at all, and the names of a series of them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph::io {

/// A file under a temporary name in the folder of its final one, until commit() renames it. Without a commit it is
/// removed. Two that write to the same final name do not disturb each other: the last commit stays.
class OutputFile {
 public:
  /// Parent folders are made; the temporary file is there and empty. @throws std::runtime_error
  explicit OutputFile(std::filesystem::path final_path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  const std::filesystem::path& final_path() const { return final_; }
  /// For libraries that write by name.
  const std::filesystem::path& temporary_path() const { return temporary_; }
  /// Appends. @throws std::runtime_error, as when the disk is full
  void write(std::span<const std::byte> data);
  void write(std::string_view text) { write(std::as_bytes(std::span(text))); }

  /// Waits until the content is on the disk, so that commit() leaves a whole file even when the power fails.
  /// Costs milliseconds: for files that come once, not for one a frame. @throws std::runtime_error
  void sync();
  /// Gives the file its final name, in place of what is there. @throws std::runtime_error
  void commit();

 private:
  void close();
  [[noreturn]] void fail(const char* what, int error) const;

  std::filesystem::path final_, temporary_;
  int descriptor_ = -1;
};

/// Writes to a file that is there, from its beginning. For what the host gave a temporary name.
class FileWriter {
 public:
  explicit FileWriter(std::filesystem::path path);  ///< @throws std::runtime_error
  ~FileWriter();
  FileWriter(const FileWriter&) = delete;
  FileWriter& operator=(const FileWriter&) = delete;
  /// @throws std::runtime_error, as when the disk is full
  void write(std::span<const std::byte> data);
  void write(std::string_view text) { write(std::as_bytes(std::span(text))); }

 private:
  std::filesystem::path path_;
  int descriptor_;
};

/// Writes a whole file at once, synced. @throws std::runtime_error
void write_file(const std::filesystem::path& path, std::string_view content);

/// The path of an output, one file or one a frame: "out/cloud_{frame:06}.pcd"; {frame} without leading zeros.
class OutputPattern {
 public:
  OutputPattern() = default;
  /// @throws std::runtime_error when braces are not {frame} or {frame:06}, stand in a folder's name or come twice
  explicit OutputPattern(const std::string& path) : OutputPattern(path, path) {}
  /// The path of what a user wrote relative to some folder: braces in the names of the folders above are not a pattern.
  /// @throws std::runtime_error likewise
  OutputPattern(const std::filesystem::path& path, const std::string& written);
  /// Pattern of a single file with any name.
  static OutputPattern of_file(const std::filesystem::path& path);

  /// Returns whether there is a file per frame.
  bool numbered() const { return numbered_; }
  /// This pattern with _{frame:06} before the extension.
  OutputPattern with_number() const;
  /// This pattern in another folder.
  OutputPattern in_folder(std::filesystem::path folder) const;
  const std::filesystem::path& folder() const { return folder_; }
  /// The pattern as it is written.
  std::string text() const;
  std::filesystem::path path(std::uint64_t frame) const;
  /// The one file beside the series: the placeholder and the separators before it taken out, another extension:
  /// "out/cloud_{frame:06}.pcd" and ".provenance.json" give "out/cloud.provenance.json".
  std::filesystem::path companion(std::string_view extension) const;
  /// Returns whether a name can result from both.
  bool overlaps(const OutputPattern& other) const;
  /// The files that are there and that the pattern can produce, by name.
  std::vector<std::filesystem::path> members() const;
  /// The first of them, or an empty path.
  std::filesystem::path existing() const;

 private:
  bool produces(std::string_view name) const;

  std::filesystem::path folder_;
  std::string before_, after_;  // of the file's name
  int digits_ = 0;
  bool numbered_ = false;
};

/// Why a file cannot be made at this path, or nothing: the folder, or the nearest that exists, cannot be written to, or
/// the path is a folder. Touches nothing.
std::string write_error(const std::filesystem::path& path);

/// Why an output cannot be where a file is that is read meanwhile, or nothing; links are followed.
std::string input_problem(const OutputPattern& pattern, std::span<const std::filesystem::path> inputs);
std::string input_problem(const std::filesystem::path& file, std::span<const std::filesystem::path> inputs);

/// Check of an output before the first frame. @returns reason why it is impossible, or nothing.
/// @param overwrite existing files may be replaced
std::string output_problem(const OutputPattern& pattern, bool overwrite);
/// @param allowed_by what the user can write for that
std::string output_problem(const std::filesystem::path& file, bool overwrite,
                           std::string_view allowed_by = "--force or overwrite: true");

}  // namespace tofgraph::io
