// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Folder of one device: copies of its profile and calibrations with their hashes, and the profile and model generated
/// from them. The layout is documented in docs/formats/camera_folder.md.
#pragma once

#include "config/document.hpp"

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::io {

/// File in the folder.
struct FolderFile {
  std::filesystem::path file;  ///< relative to the folder
  std::string sha256;
};

/// Profile, calibration or model with the files that it references.
struct FolderEntry {
  std::string kind;                                    ///< profile, model, or the kind of the calibration
  std::vector<FolderFile> files;                       ///< the calibration itself first
  std::string serial;                                  ///< of the device; empty: not stated
  std::string date, valid_until;                       ///< as 2026-11-26; empty: not stated
  std::optional<std::array<double, 2>> temperature{};  ///< K, minimum and maximum of its validity
};

struct CameraFolder {
  std::filesystem::path folder;      ///< absolute
  std::string name, serial;          ///< serial: empty if not yet known
  std::vector<FolderEntry> entries;  ///< the profile first
  std::vector<FolderFile> made;      ///< generated from the entries, for pipelines: the profile, and the model if any
  std::vector<std::string> notes;    ///< which of two calibrations is used if both cover the same effect

  /// Entry of a kind, or null.
  const FolderEntry* find(std::string_view kind) const;
  /// Absolute path of the calibration file of a kind; empty: none.
  std::filesystem::path file_of(std::string_view kind) const;
  /// True if the profile names a model generated from the entries.
  bool has_model() const { return made.size() > 1; }
};

inline constexpr const char* folder_index_name = "camera.yaml";
inline constexpr const char* folder_profile_name = "profile.yaml";
inline constexpr const char* folder_model_name = "model.yaml";

/// $XDG_DATA_HOME/tofgraph/cameras, or ~/.local/share/tofgraph/cameras; empty if neither is known.
std::filesystem::path cameras_folder();
/// Names of the folders in cameras_folder().
std::vector<std::string> camera_folder_names();

/// Folder that a camera's name or path refers to; empty if it refers to a profile or to nothing. A path refers to a
/// folder if it is the folder or its camera.yaml. @param base folder to which relative paths refer
std::filesystem::path find_camera_folder(const std::string& name, const std::filesystem::path& base);

/// Reads camera.yaml. The listed files need not exist: see folder_problems().
/// @throws config::ConfigurationError with all errors, also if camera.yaml is missing
CameraFolder read_camera_folder(const std::filesystem::path& folder);
/// Files that are missing or were modified since they were added, one message each.
std::vector<std::string> folder_problems(const CameraFolder& folder);
/// Writes camera.yaml atomically. @throws std::runtime_error
void write_camera_folder(const CameraFolder& folder);

/// File in the folder with its hash. @throws std::runtime_error if it cannot be read
FolderFile hashed_file(const std::filesystem::path& folder, const std::filesystem::path& relative);

/// Calibrations that are used outside their valid dates or temperatures, one message each.
/// @param date of the recording, e.g. 2026-11-26; empty: unknown
/// @param temperature minimum and maximum during the recording, K; NaN: unknown
std::vector<std::string> expired_calibrations(const CameraFolder& folder, const std::string& date,
                                              const std::array<double, 2>& temperature);

}  // namespace tofgraph::io
