// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Simulation of a scene with a model: its conditions, and the frames of each.
#pragma once

#include "simulation/files/model.hpp"
#include "simulation/frames.hpp"
#include "simulation/scene.hpp"

#include <optional>

namespace tofgraph::simulation {

/// Values that replace those of the scene.
struct SimulationChanges {
  std::filesystem::path model;
  std::optional<std::uint64_t> seed;
  std::optional<std::int64_t> frames;
  std::shared_ptr<graph::Host> host = nullptr;  ///< receiver of effects' messages; default: standard error
  std::optional<double> integration_time = {};  ///< s, for every condition
  std::vector<std::string> output = {};         ///< any of phases, taps, distance
};

/// Prepared condition; frames of different numbers may be computed concurrently.
struct ConditionFrames {
  SceneCondition condition;
  Acquisition acquisition;
  Frames frames;
};

/// Conditions may be prepared from several threads at the same time.
class Simulation {
 public:
  /// Reads a scene, its model and its assets. Errors are reported to the diagnostics; null if there are any.
  static std::unique_ptr<Simulation> read(const std::filesystem::path& scene, const graph::PluginRegistry& registry,
                                          const SimulationChanges& changes, config::Diagnostics& diagnostics);

  const SceneFile& scene() const { return scene_; }
  const tofgraph_camera& camera() const { return scene_.camera->view(); }
  const Model& model() const { return model_; }
  const std::vector<EffectPtr>& effects() const { return forward_.effects(); }
  const Pixels& pixels() const { return pixels_; }
  std::uint64_t frames() const { return static_cast<std::uint64_t>(scene_.frames); }
  std::uint64_t seed() const { return static_cast<std::uint64_t>(scene_.seed); }
  const std::vector<SceneCondition>& conditions() const { return conditions_; }
  bool has_output(std::string_view name) const;

  /// @throws std::exception if the scene or an effect does not support this condition
  std::unique_ptr<const ConditionFrames> prepare(std::size_t condition) const;

  /// Metadata of a frame: time stamps from the frame rate, starting at 0 in each condition.
  tofgraph_metadata metadata(const Condition& condition, std::uint64_t frame) const;

 private:
  Simulation(SceneFile scene, Model model, std::vector<EffectPtr> effects);

  SceneFile scene_;
  Model model_;
  Pixels pixels_;
  ForwardModel forward_;
  physics::TapNoise noise_;
  std::vector<SceneCondition> conditions_;
};

/// Condition of a scene or campaign as input of the forward model.
Acquisition acquisition_of(const tofgraph_camera& camera, const Condition& condition);

/// Error-free depth: z of each pixel's point, m; NaN where there is no surface.
std::vector<float> true_depth(const std::vector<Hit>& hits);

}  // namespace tofgraph::simulation
