// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Making a camera's folder: calibrations are checked, copied, and joined to one profile and one model.
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

/// Options of the calibrations that are added.
struct AddOptions {
  bool replace = false;                                ///< a calibration of a kind that the folder has is replaced
  bool other_serial = false;                           ///< a calibration of another device is added, with a note
  std::string date, valid_until;                       ///< as 2026-11-26; date empty: that of the file
  std::optional<std::array<double, 2>> temperature{};  ///< K, first and last that they are for
};

/// Makes a folder with the copy of a profile. @param serial empty: that of the first calibration which states one
/// @throws config::ConfigurationError a folder that exists, a profile with mistakes @throws std::runtime_error
io::CameraFolder make_camera_folder(const std::filesystem::path& folder, const std::string& name,
                                    const io::Camera& profile, const std::string& serial,
                                    const graph::PluginRegistry& registry);

/// Adds calibrations and models with the files beside them, and makes the folder's profile and model again. Nothing is
/// changed when one of them cannot be added.
/// @param files may be none: the profile and the model are made again
/// @returns remarks for the user
/// @throws config::ConfigurationError with every mistake: another camera, another serial, maps of another size, a kind
/// that the folder has already @throws std::runtime_error
std::vector<std::string> add_calibrations(io::CameraFolder& folder, const std::vector<std::filesystem::path>& files,
                                          const AddOptions& options, const graph::PluginRegistry& registry);

/// Makes the folder's profile and model from its entries, and the notes on what two of them know of.
/// @throws config::ConfigurationError, std::runtime_error
void assemble_camera(io::CameraFolder& folder, const graph::PluginRegistry& registry);

/// The model joined of the entries of a folder: the effects of the model without those that a calibration of their own
/// has or that the offset calibration knows of, the effects of the other calibrations, and a constant that keeps the
/// sum of all constants what it was measured as.
struct JoinedModel {
  std::vector<config::Value> effects;  ///< with absolute paths
  std::vector<std::string> notes;
};
/// @throws config::ConfigurationError, std::runtime_error
JoinedModel joined_model(const io::CameraFolder& folder, const graph::PluginRegistry& registry);

/// The effects of a calibration, NAME.model.yaml beside NAME.yaml.
std::filesystem::path model_beside(const std::filesystem::path& calibration);

}  // namespace tofgraph::simulation
