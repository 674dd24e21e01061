// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Scene files: objects, camera settings, and their changes between conditions. Reads no mesh, no image and no
/// model.
#pragma once

#include "config/document.hpp"
#include "io/camera.hpp"
#include "io/campaign.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::simulation {

using io::Condition;

/// Keys that change together, and their values, one row per step.
struct SequenceStep {
  std::vector<std::string> keys;
  std::vector<std::vector<config::Value>> rows;  ///< each as long as keys
};

/// Noise of the taps in counts.
struct SceneNoise {
  enum class From { profile, none, scene };
  From from = From::profile;
  double read_noise = 0;  ///< standard deviation, if stated in the scene
  double shot_noise = 0;  ///< variance per count, likewise
};

struct Assets;
struct Objects;

/// Condition of a scene with its objects.
struct SceneCondition : Condition {
  std::shared_ptr<const Objects> objects;  ///< null: only the condition's board
};

struct SceneFile {
  std::string name;
  config::Value document;
  io::CameraPtr camera;                          ///< never null in a scene without errors
  std::optional<config::Value> model;            ///< a map, or the name of a file; none: the ideal camera
  std::int64_t frames = 1;                       ///< per condition
  std::vector<std::string> output = {"phases"};  ///< any of phases, taps, distance
  SceneNoise noise;
  std::int64_t seed = 1;
  std::int64_t subpixels = 1;        ///< a pixel has subpixels x subpixels rays
  Condition settings;                ///< settings that the sequence does not change
  std::vector<std::string> objects;  ///< names, in the order of the file
  std::vector<SequenceStep> sequence;
  std::shared_ptr<const Assets> assets;  ///< meshes and images, see load_assets
};

/// Reads a scene and checks everything except meshes and images, including the geometry of each condition. Errors are
/// reported to the diagnostics; the result must not be used in that case.
SceneFile read_scene(const config::Value& document, config::Diagnostics& diagnostics);
/// @throws config::ConfigurationError if the file cannot be read or is not YAML
SceneFile read_scene(const std::filesystem::path& file, config::Diagnostics& diagnostics);

/// Conditions of the sequence: the Cartesian product of its steps, the last varying fastest; one without a sequence.
/// A scene that consists of one board sets the condition's board with its reflectivity and a label.
std::vector<SceneCondition> expand(const SceneFile& scene);

/// Scene document for one of these conditions alone, without a sequence.
config::Value document_of(const SceneFile& scene, std::size_t condition);

/// Chessboard of a scene that has exactly one, for a campaign.
std::optional<io::Pattern> pattern_of(const SceneFile& scene);

/// Name of the scene's camera for a file in this folder: names are kept, paths become relative to the folder.
std::string camera_name_in(const SceneFile& scene, const std::filesystem::path& folder);

}  // namespace tofgraph::simulation
