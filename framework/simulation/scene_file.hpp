// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Scene files: what stands before the camera, how it is looked at, and what of this changes from one condition
/// to the next. Reads no mesh, no image and no model.
#pragma once

#include "core/camera.hpp"
#include "core/document.hpp"
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
  std::vector<std::vector<core::Value>> rows;  ///< each as long as keys
};

/// Noise of the taps in counts.
struct SceneNoise {
  enum class From { profile, none, scene };
  From from = From::profile;
  double read_noise = 0;  ///< standard deviation, where it is from the scene
  double shot_noise = 0;  ///< variance per count, likewise
};

struct Assets;

struct SceneFile {
  std::string name;
  core::Value document;
  core::CameraPtr camera;                        ///< always there in a scene without mistakes
  std::optional<core::Value> model;              ///< a map, or the word that names a file; none: the ideal camera
  std::int64_t frames = 1;                       ///< of each condition
  std::vector<std::string> output = {"phases"};  ///< of phases, taps, distance
  SceneNoise noise;
  std::int64_t seed = 1;
  std::int64_t subpixels = 1;        ///< rays of a pixel are subpixels x subpixels
  Condition settings;                ///< how it is looked at where the sequence says nothing else
  std::vector<std::string> objects;  ///< names, in the order of the file
  std::vector<SequenceStep> sequence;
  std::shared_ptr<const Assets> assets;  ///< meshes and images, see load_assets
};

/// Reads a scene and checks all that can be checked without meshes and images, each condition's geometry included.
/// Mistakes go to the diagnostics; the result is then not to be used.
SceneFile read_scene(const core::Value& document, core::Diagnostics& diagnostics);
/// @throws core::ConfigurationError when the file cannot be read or is no YAML
SceneFile read_scene(const std::filesystem::path& file, core::Diagnostics& diagnostics);

/// The conditions of the sequence: the product of its steps, the last one fastest; one condition where there is none.
/// A scene of one board and nothing else gives the condition's board; its reflectivity and a label come along.
std::vector<Condition> expand(const SceneFile& scene);

/// The scene as it would be written for one of these conditions alone, without a sequence.
core::Value document_of(const SceneFile& scene, std::size_t condition);

/// The chessboard of a scene that has exactly one, for a campaign.
std::optional<io::Pattern> pattern_of(const SceneFile& scene);

/// How the scene's camera is called in a file of this folder: a name stays, a path becomes relative to it.
std::string camera_name_in(const SceneFile& scene, const std::filesystem::path& folder);

}  // namespace tofgraph::simulation
