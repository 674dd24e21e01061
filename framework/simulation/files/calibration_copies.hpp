// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Calibrations on their way into a camera's folder: checked, with the files that they name. For
/// camera_assembly.cpp only.
#pragma once

#include "simulation/files/camera_assembly.hpp"

#include <map>
#include <set>

namespace tofgraph::simulation {

/// A file to copy, and the text in its place where paths in it change.
struct FolderCopy {
  std::filesystem::path from, to;  ///< to: relative to the folder
  std::string text;                ///< empty: as it is
};

/// Maps of the pixels of a calibration, NAME.maps.h5 beside NAME.yaml.
std::filesystem::path maps_beside(const std::filesystem::path& calibration);
inline constexpr const char* bad_pixel_dataset = "bad";  ///< in the maps of a noise calibration
/// True for a regular file.
bool is_there(const std::filesystem::path& file);
/// Day of the file's last change, as 2026-11-26; empty: not known.
std::string date_of(const std::filesystem::path& file);

/// The entry of a calibration or model without hashes. @param copies gets the files to copy
/// @param camera of the folder @throws config::ConfigurationError with every mistake @throws std::runtime_error
io::FolderEntry entry_of(const std::filesystem::path& file, const io::Camera& camera, const AddOptions& options,
                         const graph::PluginRegistry& registry, std::vector<FolderCopy>& copies);
/// @throws std::runtime_error
void copy_into(const io::CameraFolder& folder, const std::vector<FolderCopy>& copies);

/// Adds the absolute paths of a value that with_absolute_paths() has changed.
void collect_files(const config::Value& value, std::set<std::string>& files);
/// The same value with other names of its files. @param names by what is written
config::Value with_paths(config::Value value, const std::map<std::string, std::string>& names);
/// A model as a file, one effect a line. @param head another model, whose serial, light, name and comment are kept
/// @param names of the effects' files, by their absolute path
std::string model_text(const config::Value& head, const std::vector<config::Value>& effects, const std::string& camera,
                       const std::map<std::string, std::string>& names);

}  // namespace tofgraph::simulation
