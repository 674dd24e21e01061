// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Model files: light and effects of a camera for the simulation.
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
  std::string camera;          ///< name or path of a profile, "" if the model is part of a scene
  config::Position camera_at;  ///< position in the file
  std::string serial;          ///< of the device; empty: not stated
  bool physical = false;       ///< light: physical
  std::vector<ModelEffect> effects;
};

/// Reads a model from a file or a part of a scene. All errors are reported to the diagnostics.
Model read_model(const config::Value& document, const graph::PluginRegistry& registry,
                 config::Diagnostics& diagnostics);

/// Reads a model file; its first line must be `model: 1`.
Model load_model(const std::filesystem::path& file, const graph::PluginRegistry& registry,
                 config::Diagnostics& diagnostics);

/// Model of a scene: a map in it, a file named by it, or the ideal camera if it states none.
Model model_of_scene(const std::optional<config::Value>& model, const graph::PluginRegistry& registry,
                     config::Diagnostics& diagnostics);

/// Returns true if the model's profile, by name or path, is that of this camera; a model without profile fits all.
bool is_for(const Model& model, const io::Camera& camera);

/// Creates the effects for a camera; their errors and warnings go to the diagnostics at the position of the parameter.
/// @param host receiver of later messages; default: standard error
std::vector<EffectPtr> make_effects(const Model& model, const tofgraph_camera& camera, config::Diagnostics& diagnostics,
                                    const std::shared_ptr<graph::Host>& host = nullptr);

/// Files from which a model's effects take values.
std::vector<std::string> files_of(const Model& model);

/// Effects as written, including default values, for the provenance.
nlohmann::json described(const Model& model);

}  // namespace tofgraph::simulation
