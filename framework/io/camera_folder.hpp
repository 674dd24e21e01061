// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The folder of one device: copies of its profile and calibrations with their hashes, and the profile and model that
/// are made from them. The layout is documented in docs/formats/camera_folder.md.
#pragma once

#include "config/document.hpp"

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::io {

/// A file of the folder.
struct FolderFile {
  std::filesystem::path file;  ///< relative to the folder
  std::string sha256;
};

/// A profile, a calibration or a model with the files that it names.
struct FolderEntry {
  std::string kind;                                    ///< profile, model, or the kind of the calibration
  std::vector<FolderFile> files;                       ///< the calibration itself first
  std::string serial;                                  ///< device's; empty: not stated
  std::string date, valid_until;                       ///< as 2026-11-26; empty: not stated
  std::optional<std::array<double, 2>> temperature{};  ///< K, first and last that it is for
};

struct CameraFolder {
  std::filesystem::path folder;      ///< absolute
  std::string name, serial;          ///< serial: empty where it is not known yet
  std::vector<FolderEntry> entries;  ///< the profile first
  std::vector<FolderFile> made;      ///< made from the entries, for pipelines: the profile, the model if there is one
  std::vector<std::string> notes;    ///< which of two calibrations is used where both know of an effect

  /// The entry of a kind, or null.
  const FolderEntry* find(std::string_view kind) const;
  /// The calibration file of a kind, absolute; empty: none.
  std::filesystem::path file_of(std::string_view kind) const;
  /// True when the profile names a model, made from the entries.
  bool has_model() const { return made.size() > 1; }
};

inline constexpr const char* folder_index_name = "camera.yaml";
inline constexpr const char* folder_profile_name = "profile.yaml";
inline constexpr const char* folder_model_name = "model.yaml";

/// $XDG_DATA_HOME/tofgraph/cameras, or ~/.local/share/tofgraph/cameras; empty: neither is known.
std::filesystem::path cameras_folder();
/// Names of the folders in it.
std::vector<std::string> camera_folder_names();

/// The folder that a camera's name or path means; empty: it means a profile, or nothing. A path means a folder when it
/// is one or is the camera.yaml of one. @param base folder that relative paths start from
std::filesystem::path find_camera_folder(const std::string& name, const std::filesystem::path& base);

/// Reads camera.yaml. The files need not be there: see folder_problems().
/// @throws config::ConfigurationError with every mistake, also for a folder without camera.yaml
CameraFolder read_camera_folder(const std::filesystem::path& folder);
/// Files that are missing or were changed since they were added, one message each.
std::vector<std::string> folder_problems(const CameraFolder& folder);
/// Writes camera.yaml, whole or not at all. @throws std::runtime_error
void write_camera_folder(const CameraFolder& folder);

/// A file of the folder with its hash. @throws std::runtime_error when it cannot be read
FolderFile hashed_file(const std::filesystem::path& folder, const std::filesystem::path& relative);

/// Calibrations that are used outside the date or temperature that they are valid for, one message each.
/// @param date of the recording, as 2026-11-26; empty: not known
/// @param temperature first and last of the recording, K; NaN: not known
std::vector<std::string> expired_calibrations(const CameraFolder& folder, const std::string& date,
                                              const std::array<double, 2>& temperature);

}  // namespace tofgraph::io
