// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Scene files: what stands before the camera, how it is looked at, and what of this changes from one condition
/// to the next. Reads no mesh, no image and no model.
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

/// Keys that change together, and their values one row a step.
struct SequenceStep {
  std::vector<std::string> keys;
  std::vector<std::vector<config::Value>> rows;  ///< each as long as keys
};

/// Noise of the taps in counts.
struct SceneNoise {
  enum class From { profile, none, scene };
  From from = From::profile;
  double read_noise = 0;  ///< standard deviation, where it is from the scene
  double shot_noise = 0;  ///< variance per count, likewise
};

struct Assets;
struct Objects;

/// A condition of a scene: with all that stands before the camera.
struct SceneCondition : Condition {
  std::shared_ptr<const Objects> objects;  ///< null: the condition's board is all there is
};

struct SceneFile {
  std::string name;
  config::Value document;
  io::CameraPtr camera;                          ///< always there in a scene without mistakes
  std::optional<config::Value> model;            ///< a map, or the word that names a file; none: the ideal camera
  std::int64_t frames = 1;                       ///< per condition
  std::vector<std::string> output = {"phases"};  ///< any of phases, taps, distance
  SceneNoise noise;
  std::int64_t seed = 1;
  std::int64_t subpixels = 1;        ///< rays of a pixel are subpixels x subpixels
  Condition settings;                ///< settings unless the sequence changes them
  std::vector<std::string> objects;  ///< names, in the order of the file
  std::vector<SequenceStep> sequence;
  std::shared_ptr<const Assets> assets;  ///< meshes and images, see load_assets
};

/// Reads a scene and checks all that can be checked without meshes and images, each condition's geometry included.
/// Mistakes go to the diagnostics; the result is then not to be used.
SceneFile read_scene(const config::Value& document, config::Diagnostics& diagnostics);
/// @throws config::ConfigurationError when the file cannot be read or is not YAML
SceneFile read_scene(const std::filesystem::path& file, config::Diagnostics& diagnostics);

/// The conditions of the sequence: the product of its steps, the last one fastest; one condition where there is none.
/// A scene of one board and nothing else gives the condition's board; its reflectivity and a label come along.
std::vector<SceneCondition> expand(const SceneFile& scene);

/// The scene as it would be written for one of these conditions alone, without a sequence.
config::Value document_of(const SceneFile& scene, std::size_t condition);

/// The chessboard of a scene that has exactly one, for a campaign.
std::optional<io::Pattern> pattern_of(const SceneFile& scene);

/// Name of the scene's camera in a file of this folder: a name is kept, a path becomes relative to it.
std::string camera_name_in(const SceneFile& scene, const std::filesystem::path& folder);

}  // namespace tofgraph::simulation
