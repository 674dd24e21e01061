// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Model files: what the simulation knows of the camera's light and of its effects.
#pragma once

#include "config/document.hpp"
#include "graph/parameters.hpp"
#include "graph/plugin.hpp"
#include "io/camera.hpp"
#include "simulation/files/effect.hpp"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tofgraph::simulation {

struct ModelEffect {
  const graph::Plugin* descriptor;
  graph::ParameterValues values;
  config::Position at;
};

struct Model {
  std::string camera;          ///< a profile's name or path, "" where the model is part of a scene
  config::Position camera_at;  ///< position in the file
  std::string serial;          ///< device's; empty: not stated
  bool physical = false;       ///< light: physical
  std::vector<ModelEffect> effects;
};

/// Reads a model: what a file or the part of a scene holds. Every mistake goes to the diagnostics.
Model read_model(const config::Value& document, const graph::PluginRegistry& registry,
                 config::Diagnostics& diagnostics);

/// Reads a model file; its first line must be `model: 1`.
Model load_model(const std::filesystem::path& file, const graph::PluginRegistry& registry,
                 config::Diagnostics& diagnostics);

/// The model of a scene: a map in it, a file that it names, or, where there is none, the ideal camera.
Model model_of_scene(const std::optional<config::Value>& model, const graph::PluginRegistry& registry,
                     config::Diagnostics& diagnostics);

/// Returns whether the model's profile, by name or path, is this camera's; a model without profile is for all.
bool is_for(const Model& model, const io::Camera& camera);

/// The effects, made for a camera; what they refuse and remark goes to the diagnostics at the place of the parameter.
/// @param host whom later remarks go to; default: standard error
std::vector<EffectPtr> make_effects(const Model& model, const tofgraph_camera& camera, config::Diagnostics& diagnostics,
                                    const std::shared_ptr<graph::Host>& host = nullptr);

/// The files that a model's effects take values from.
std::vector<std::string> files_of(const Model& model);

/// The effects as they were written, defaults included, for the provenance.
nlohmann::json described(const Model& model);

}  // namespace tofgraph::simulation
