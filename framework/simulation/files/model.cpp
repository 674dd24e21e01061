// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/files/model.hpp"

#include "io/profile.hpp"

#include <fmt/format.h>

namespace tofgraph::simulation {
namespace {

using config::Diagnostics;
using config::Entry;
using config::Value;

void read_effect(const Value& item, const graph::PluginRegistry& registry, Diagnostics& diagnostics, Model& model) {
  const Entry* name = item.is_map() ? item.find("effect") : nullptr;
  if (name == nullptr) {
    diagnostics.error(item.at, "an effect is a map with its name under 'effect'",
                      "example: - {effect: wiggling, amplitude: 5 mm, phase: 0.4 rad}");
    return;
  }
  const graph::PluginFile* file = registry.find(name->value.text);
  if (file == nullptr || file->kind != "effect") {
    std::vector<std::string> names;
    for (const graph::PluginFile& other : registry.files()) {
      if (other.kind == "effect") names.push_back(other.name);
    }
    diagnostics.error(name->value.at, fmt::format("there is no effect '{}'", name->value.text),
                      config::suggestion(name->value.text, names, "effects"));
    return;
  }
  try {
    const graph::Plugin& descriptor = registry.load(*file);
    std::vector<const Entry*> written;
    for (const Entry& entry : item.entries) {
      if (&entry != name) written.push_back(&entry);
    }
    model.effects.push_back({&descriptor, {descriptor, written, item.at, diagnostics}, item.at});
  } catch (const graph::PluginError& error) {
    diagnostics.error(name->value.at, error.what());
  }
}

}  // namespace

Model read_model(const Value& document, const graph::PluginRegistry& registry, Diagnostics& diagnostics) {
  Model model;
  config::Reader reader(document, diagnostics, "the model");
  reader.take("model");
  reader.take("name");
  reader.take("comment");
  model.camera = reader.word("camera", "");
  model.serial = reader.word("serial", "");
  if (const Entry* camera = document.find("camera")) model.camera_at = camera->value.at;
  const std::string light = reader.word("light", "reference");
  if (light != "reference" && light != "physical") {
    const Entry* entry = document.find("light");
    const std::vector<std::string> choices = {"reference", "physical"};
    const std::string near = config::nearest(light, choices);
    diagnostics.error(entry->value.at, fmt::format("'light' is '{}', expected one of: reference physical", light),
                      near.empty() ? "example: light: reference" : fmt::format("did you mean '{}'?", near));
  }
  model.physical = light == "physical";
  if (const Entry* effects = reader.take("effects")) {
    if (!effects->value.is_list() && effects->value.kind != Value::Kind::null)
      diagnostics.error(effects->value.at, fmt::format("effects is {}, expected a list", effects->value.described()),
                        "example: effects: [{effect: wiggling, amplitude: 5 mm}]");
    for (const Value& item : effects->value.items) read_effect(item, registry, diagnostics, model);
  }
  reader.finish();
  return model;
}

Model load_model(const std::filesystem::path& file, const graph::PluginRegistry& registry, Diagnostics& diagnostics) {
  const Value document = config::load_document(file);
  config::check_version(document, "model", 1, diagnostics);
  return read_model(document, registry, diagnostics);
}

Model model_of_scene(const std::optional<Value>& model, const graph::PluginRegistry& registry,
                     Diagnostics& diagnostics) {
  if (!model) return {};
  if (model->is_map()) return read_model(*model, registry, diagnostics);
  const std::filesystem::path file = config::path_at(model->text, model->at);
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return {};  // reported when the scene was read
  try {
    return load_model(file, registry, diagnostics);
  } catch (const config::ConfigurationError& failure) {
    diagnostics.add(failure, model->at);
    return {};
  }
}

bool is_for(const Model& model, const io::Camera& camera) {
  if (model.camera.empty() || model.camera == camera.view().name) return true;
  const auto base = model.camera_at.source ? model.camera_at.source->base : std::filesystem::path{};
  const std::filesystem::path file = io::find_profile(model.camera, base);
  std::error_code error;
  if (!camera.file.empty() && std::filesystem::equivalent(file, camera.file, error)) return true;
  try {
    return !file.empty() && std::string_view(io::load_profile(file)->view().name) == camera.view().name;
  } catch (const config::ConfigurationError&) {
    return false;  // an unreadable profile does not match
  }
}

std::vector<EffectPtr> make_effects(const Model& model, const tofgraph_camera& camera, Diagnostics& diagnostics,
                                    const std::shared_ptr<graph::Host>& host) {
  std::vector<EffectPtr> effects;
  if (!diagnostics.ok()) return effects;  // rejected values are not used
  for (const ModelEffect& effect : model.effects) {
    if (!effect.values.images_fit(camera, diagnostics)) continue;
    try {
      const auto kept = std::make_shared<const graph::ParameterValues>(effect.values);  // owns the memory of images
      effects.push_back(std::make_shared<const Effect>(*effect.descriptor, kept->data(), camera, kept, host));
      for (const std::string& warning : effects.back()->warnings())
        diagnostics.warning(effect.at, fmt::format("effect {}: {}", effects.back()->name(), warning));
    } catch (const EffectError& error) {
      diagnostics.error(error.parameter.empty() ? effect.at : effect.values.position_of(error.parameter), error.what());
    }
  }
  return effects;
}

std::vector<std::string> files_of(const Model& model) {
  std::vector<std::string> files;
  for (const ModelEffect& effect : model.effects) {
    for (const std::string& file : effect.values.files()) files.push_back(file);
  }
  return files;
}

nlohmann::json described(const Model& model) {
  nlohmann::json effects = nlohmann::json::array();
  for (const ModelEffect& effect : model.effects)
    effects.push_back({{"effect", effect.descriptor->name}, {"parameters", effect.values.shown()}});
  return {{"light", model.physical ? "physical" : "reference"}, {"effects", effects}};
}

}  // namespace tofgraph::simulation
