// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/candidate.hpp"

#include <fmt/format.h>

#include "diagnosis/observables.hpp"
#include "io/image_file.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tofgraph::diagnosis {
namespace {

std::shared_ptr<const graph::ParameterValues> defaults_of(const graph::Plugin& descriptor) {
  config::Diagnostics diagnostics;
  auto values = std::make_shared<const graph::ParameterValues>(descriptor, std::vector<const config::Entry*>{},
                                                               config::Position{}, diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  return values;
}

/// A few values of a shape. An angle that may be anything: around the circle; else about what is usual, within bounds.
std::vector<double> tried(const FreeParameter& shape) {
  constexpr double turn = 2 * std::numbers::pi;
  if (shape.unit == "rad" && shape.maximum - shape.minimum > 0.99 * turn) {
    constexpr int steps = 6;
    std::vector<double> values;
    for (int i = 0; i < steps; ++i) values.push_back(shape.minimum + turn * i / steps);
    return values;
  }
  std::vector<double> values;
  for (const double factor : {1.0, 0.3, 3.0}) {
    const double value = std::clamp(factor * shape.typical, shape.minimum, shape.maximum);
    if (std::ranges::find(values, value) == values.end()) values.push_back(value);
  }
  return values;
}

}  // namespace

EstimatedMaps::EstimatedMaps(std::vector<Map> maps, double dimension, std::size_t grid, const tofgraph_camera& camera)
    : maps_(std::move(maps)), dimension_(dimension) {
  for (const Map& map : maps_) {
    std::vector<double>& values = pixels_.emplace_back(std::size_t{camera.width} * camera.height);
    for (std::size_t p = 0; p < values.size(); ++p)
      values[p] = map.values[superpixel_of(p / camera.width, camera.height, grid) * grid +
                             superpixel_of(p % camera.width, camera.width, grid)];
    images_.push_back(io::image_view(values.data(), camera.height, camera.width, map.parameter.name.c_str(),
                                     map.parameter.unit.c_str()));
  }
}

Candidate::Candidate(const graph::Plugin& plugin)
    : descriptor_(&plugin), owned_(defaults_of(plugin)), written_(owned_.get()) {
  find_free();
  find_maps();
}

Candidate::Candidate(const simulation::ModelEffect& effect) : descriptor_(effect.descriptor), written_(&effect.values) {
  find_free();
}

void Candidate::find_free() {
  for (std::uint64_t i = 0; i < descriptor_->parameter_count; ++i) {
    const tofgraph_parameter& p = descriptor_->parameters[i];
    if (p.kind != TOFGRAPH_KIND_NUMBER || !std::isfinite(p.typical)) continue;
    const bool shape = !std::isfinite(p.off);
    const auto bound = [](double value, double none) { return std::isnan(value) ? none : value; };
    free_.push_back({i, p.name, p.unit, shape, shape ? p.typical : p.off, p.typical,
                     bound(p.minimum, -std::numeric_limits<double>::infinity()),
                     bound(p.maximum, std::numeric_limits<double>::infinity())});
  }
  // Without a size nothing can be searched: shapes alone change nothing.
  if (sizes() == 0) free_.clear();
}

void Candidate::find_maps() {
  if (free_.size() != 1 || free_.front().shape || free_.front().off != 0) return;
  for (std::uint64_t i = 0; i < descriptor_->parameter_count; ++i) {
    const tofgraph_parameter& p = descriptor_->parameters[i];
    if (p.kind == TOFGRAPH_KIND_IMAGE && written_->data()[i].given == 0) maps_.push_back({i, p.name, p.unit});
  }
}

std::size_t Candidate::sizes() const {
  return static_cast<std::size_t>(std::ranges::count(free_, false, &FreeParameter::shape));
}

bool Candidate::reads_files() const {
  for (std::uint64_t i = 0; i < descriptor_->parameter_count; ++i) {
    const std::uint32_t kind = descriptor_->parameters[i].kind;
    const bool file = kind == TOFGRAPH_KIND_INPUT_FILE || kind == TOFGRAPH_KIND_IMAGE;
    if (file && written_->data()[i].given != 0) return true;
  }
  return false;
}

std::vector<double> Candidate::start() const {
  std::vector<double> values;
  for (const FreeParameter& p : free_) values.push_back(written_->data()[p.index].number);
  return values;
}

std::vector<std::vector<double>> Candidate::probes() const {
  std::vector<std::vector<double>> all(1);
  for (const FreeParameter& p : free_) {
    const std::vector<double> values = p.shape ? tried(p) : std::vector<double>{p.off};
    std::vector<std::vector<double>> longer;
    for (const std::vector<double>& before : all) {
      for (const double value : values) {
        longer.push_back(before);
        longer.back().push_back(value);
      }
    }
    all = std::move(longer);
  }
  return all;
}

simulation::EffectPtr Candidate::make(std::span<const double> free_values, const tofgraph_camera& camera,
                                      std::shared_ptr<const EstimatedMaps> maps) const {
  std::vector<tofgraph_value> values(written_->data(), written_->data() + descriptor_->parameter_count);
  for (std::size_t i = 0; i < free_.size(); ++i) {
    values[free_[i].index].number = free_values[i];
    values[free_[i].index].given = 1;
  }
  for (std::size_t m = 0; maps != nullptr && m < maps->maps().size(); ++m) {
    tofgraph_value& map = values[maps->maps()[m].parameter.index];
    map.image = &maps->image(m);
    map.given = 1;
  }
  return std::make_shared<const simulation::Effect>(*descriptor_, values.data(), camera, std::move(maps));
}

std::string Candidate::yaml(std::span<const double> free_values, const EstimatedMaps* maps,
                            const std::string& map_file) const {
  std::string text = "{effect: " + name();
  for (std::uint64_t i = 0; i < descriptor_->parameter_count; ++i) {
    const tofgraph_parameter& p = descriptor_->parameters[i];
    const auto varied = std::ranges::find(free_, i, &FreeParameter::index);
    if (varied != free_.end()) {
      const double value = free_values[static_cast<std::size_t>(varied - free_.begin())];
      text += fmt::format(", {}: {:.9g}{}{}", p.name, value, *p.unit != 0 ? " " : "", p.unit);
    } else if (written_->data()[i].given != 0) {
      const nlohmann::json& shown = written_->shown()[p.name];  // an object is a map of YAML as it is
      text += fmt::format(", {}: {}", p.name,
                          shown.is_string() ? config::yaml_word(shown.get<std::string>()) : shown.dump());
    }
  }
  for (std::size_t m = 0; maps != nullptr && m < maps->maps().size(); ++m) {
    const MapParameter& map = maps->maps()[m].parameter;
    text += fmt::format(", {}: {{file: {}, dataset: {}}}", map.name, map_file, map_dataset(map));
  }
  return text + "}";
}

simulation::ForwardModel forward_model(std::span<const Term> terms, const tofgraph_camera& camera, bool physical) {
  std::vector<simulation::EffectPtr> effects;
  for (const Term& term : terms) effects.push_back(term.candidate->make(term.values, camera, term.maps));
  return {camera, physical, std::move(effects)};
}

}  // namespace tofgraph::diagnosis
