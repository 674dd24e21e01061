// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Reading of models by stages.
#pragma once

#include <tofgraph/stage.hpp>

#include <memory>
#include <string>
#include <vector>

#include "config/paths.hpp"
#include "simulation/effect_check.hpp"
#include "simulation/files/model.hpp"

namespace tofgraph {

/// Reads models. Effects come from the plugins of the stage's run; their warnings are reported as the stage's.
class ModelReader {
 public:
  explicit ModelReader(const Stage& stage) : stage_(stage) {}

  struct Made {
    simulation::Model model;
    std::vector<simulation::EffectPtr> effects;
  };
  /// Reads a model file or an inline model, creates its effects for a camera, and registers the files used.
  /// @param parameter of the stage that names the file @throws ConfigError
  Made read(const Setup& setup, const char* parameter, const std::string& file, const tofgraph_camera& camera) const {
    config::Diagnostics diagnostics;
    try {
      const bool in_place = file.starts_with('{');
      Made made{in_place ? simulation::read_model(config::parse_document(parameter, file), registry(), diagnostics)
                         : simulation::load_model(file, registry(), diagnostics),
                {}};
      made.effects = simulation::make_effects(made.model, camera, diagnostics, host());
      simulation::validate_effects(made.model, camera, diagnostics);
      use_files(setup, made.model, made.effects);
      pass_on(diagnostics);
      if (diagnostics.ok()) return made;
    } catch (const config::ConfigurationError& error) {
      throw ConfigError(parameter, error.what());
    }
    throw ConfigError(parameter, diagnostics.text());
  }

  graph::PluginRegistry registry() const {
    return graph::PluginRegistry(config::split_path(stage_.host->plugin_path(stage_.context)));
  }
  /// Host of the effects; the stage must outlive it.
  std::shared_ptr<graph::Host> host() const {
    auto own = std::make_shared<graph::Host>();
    own->plugin_path = stage_.host->plugin_path(stage_.context);
    own->message = [stage = &stage_](const std::string& name, const std::string& text, bool) {
      stage->warn("effect " + name + ": " + text);
    };
    return own;
  }
  void pass_on(const config::Diagnostics& diagnostics) const {
    for (const config::Diagnostic& remark : diagnostics.all())
      if (remark.severity == config::Severity::warning) stage_.warn(remark.message);
  }
  static void use_files(const Setup& setup, const simulation::Model& model,
                        const std::vector<simulation::EffectPtr>& effects) {
    for (const std::string& file : simulation::files_of(model)) setup.uses_file(file);
    for (const simulation::EffectPtr& effect : effects)
      for (const graph::UsedFile& file : effect->files()) setup.uses_file(file.path);
  }

 private:
  const Stage& stage_;
};

}  // namespace tofgraph
