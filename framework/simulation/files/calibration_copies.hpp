// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Calibrations to be copied into a camera's folder: checked, with the files that they reference. For
/// camera_assembly.cpp only.
#pragma once

#include "simulation/files/camera_assembly.hpp"

#include <map>
#include <set>

namespace tofgraph::simulation {

/// File to copy, and the text that replaces its content if paths in it change.
struct FolderCopy {
  std::filesystem::path from, to;  ///< to: relative to the folder
  std::string text;                ///< empty: unchanged
};

/// Pixel maps of a calibration, NAME.maps.h5 beside NAME.yaml.
std::filesystem::path maps_beside(const std::filesystem::path& calibration);
inline constexpr const char* bad_pixel_dataset = "bad";  ///< in the maps of a noise calibration
/// True for a regular file.
bool is_there(const std::filesystem::path& file);
/// Date of the file's last modification, e.g. 2026-11-26; empty: unknown.
std::string date_of(const std::filesystem::path& file);

/// Entry of a calibration or model, without hashes. @param copies receives the files to copy
/// @param camera of the folder @throws config::ConfigurationError with all errors @throws std::runtime_error
io::FolderEntry entry_of(const std::filesystem::path& file, const io::Camera& camera, const AddOptions& options,
                         const graph::PluginRegistry& registry, std::vector<FolderCopy>& copies);
/// @throws std::runtime_error
void copy_into(const io::CameraFolder& folder, const std::vector<FolderCopy>& copies);

/// Adds the absolute paths contained in a result of with_absolute_paths().
void collect_files(const config::Value& value, std::set<std::string>& files);
/// The same value with replaced file names. @param names new name by written name
config::Value with_paths(config::Value value, const std::map<std::string, std::string>& names);
/// Text of a model file, one effect per line. @param head other model, whose serial, light, name and comment are kept
/// @param names new names of the effects' files, by absolute path
std::string model_text(const config::Value& head, const std::vector<config::Value>& effects, const std::string& camera,
                       const std::map<std::string, std::string>& names);

}  // namespace tofgraph::simulation
