// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Assembly of a camera's folder: calibrations are checked, copied, and combined into one profile and one model.
#pragma once

#include "graph/plugin.hpp"
#include "io/camera.hpp"
#include "io/camera_folder.hpp"

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::simulation {

/// Options for adding calibrations.
struct AddOptions {
  bool replace = false;                                ///< replace an existing calibration of the same kind
  bool other_serial = false;                           ///< accept a calibration of another device, with a note
  std::string date, valid_until;                       ///< e.g. 2026-11-26; date empty: that of the file
  std::optional<std::array<double, 2>> temperature{};  ///< K, minimum and maximum of their validity
};

/// Creates a folder with the copy of a profile. @param serial empty: that of the first calibration which states one
/// @throws config::ConfigurationError for an existing folder or an invalid profile @throws std::runtime_error
io::CameraFolder make_camera_folder(const std::filesystem::path& folder, const std::string& name,
                                    const io::Camera& profile, const std::string& serial,
                                    const graph::PluginRegistry& registry);

/// Adds calibrations and models with their companion files, and regenerates the folder's profile and model. Nothing is
/// changed if one of them cannot be added.
/// @param files may be empty: only the profile and the model are regenerated
/// @returns remarks for the user
/// @throws config::ConfigurationError with all errors: another camera, another serial, maps of the wrong size, a kind
/// that the folder already has @throws std::runtime_error
std::vector<std::string> add_calibrations(io::CameraFolder& folder, const std::vector<std::filesystem::path>& files,
                                          const AddOptions& options, const graph::PluginRegistry& registry);

/// Generates the folder's profile and model from its entries, and the notes on effects that two of them cover.
/// @throws config::ConfigurationError, std::runtime_error
void assemble_camera(io::CameraFolder& folder, const graph::PluginRegistry& registry);

/// Model combined from the entries of a folder: the effects of the model except those covered by a calibration of their
/// own or by the offset calibration, the effects of the other calibrations, and a constant that keeps the sum of all
/// constants at its measured value.
struct JoinedModel {
  std::vector<config::Value> effects;  ///< with absolute paths
  std::vector<std::string> notes;
};
/// @throws config::ConfigurationError, std::runtime_error
JoinedModel joined_model(const io::CameraFolder& folder, const graph::PluginRegistry& registry);

/// Effects of a calibration, NAME.model.yaml beside NAME.yaml.
std::filesystem::path model_beside(const std::filesystem::path& calibration);

}  // namespace tofgraph::simulation
