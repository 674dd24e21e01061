// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/candidate.hpp"

#include <fmt/format.h>

#include "diagnosis/observables.hpp"
#include "io/capture_map.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <system_error>

namespace tofgraph::diagnosis {
namespace {

std::shared_ptr<const core::ParameterValues> defaults_of(const tofgraph_descriptor& descriptor) {
  core::Diagnostics diagnostics;
  auto values = std::make_shared<const core::ParameterValues>(descriptor, std::vector<const core::Entry*>{},
                                                              core::Position{}, diagnostics);
  if (!diagnostics.ok()) throw core::ConfigurationError(diagnostics);
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

std::size_t parameter_at(const tofgraph_descriptor& descriptor, const std::string& name) {
  const std::span all(descriptor.parameters, descriptor.parameter_count);
  return static_cast<std::size_t>(std::ranges::find(all, name, &tofgraph_parameter::name) - all.begin());
}

}  // namespace

EstimatedMaps::EstimatedMaps(std::vector<Map> maps, double dimension, std::size_t grid, const tofgraph_camera& camera)
    : maps_(std::move(maps)), dimension_(dimension), grid_(grid), width_(camera.width), height_(camera.height) {
  std::vector<io::PixelMapData> data;
  for (const Map& map : maps_) data.push_back({map.parameter.name, of_pixels(map)});
  file_ = (std::filesystem::temp_directory_path() / "tofgraph-maps-XXXXXX").string();
  const int descriptor = mkstemp(file_.data());
  if (descriptor < 0) throw std::system_error(errno, std::generic_category(), file_);
  close(descriptor);
  try {
    io::write_pixel_maps(file_, data, height_, width_);
    io::remember_pixel_maps(file_, data, height_, width_);
  } catch (...) {
    std::remove(file_.c_str());
    throw;
  }
}

EstimatedMaps::~EstimatedMaps() {
  io::forget_pixel_maps(file_);
  std::remove(file_.c_str());
}

std::vector<double> EstimatedMaps::of_pixels(const Map& map) const {
  std::vector<double> values(width_ * height_);
  for (std::size_t p = 0; p < values.size(); ++p)
    values[p] =
        map.values[superpixel_of(p / width_, height_, grid_) * grid_ + superpixel_of(p % width_, width_, grid_)];
  return values;
}

Candidate::Candidate(const tofgraph_descriptor& descriptor)
    : descriptor_(&descriptor), owned_(defaults_of(descriptor)), written_(owned_.get()) {
  find_free();
  find_maps();
}

Candidate::Candidate(const simulation::ModelEffect& effect) : descriptor_(effect.descriptor), written_(&effect.values) {
  find_free();
}

void Candidate::find_free() {
  for (std::uint64_t i = 0; i < descriptor_->parameter_count; ++i) {
    const tofgraph_parameter& p = descriptor_->parameters[i];
    if (p.kind != TOFGRAPH_NUMBER || !std::isfinite(p.typical)) continue;
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
    const std::size_t dataset = parameter_at(*descriptor_, std::string(p.name) + "_dataset");
    if (p.kind == TOFGRAPH_INPUT_FILE && written_->data()[i].given == 0 && dataset < descriptor_->parameter_count)
      maps_.push_back({i, dataset, p.name});
  }
}

std::size_t Candidate::sizes() const {
  return static_cast<std::size_t>(std::ranges::count(free_, false, &FreeParameter::shape));
}

bool Candidate::reads_files() const {
  for (std::uint64_t i = 0; i < descriptor_->parameter_count; ++i) {
    if (descriptor_->parameters[i].kind == TOFGRAPH_INPUT_FILE && written_->data()[i].given != 0) return true;
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
                                      const EstimatedMaps* maps) const {
  std::vector<tofgraph_value> values(written_->data(), written_->data() + descriptor_->parameter_count);
  for (std::size_t i = 0; i < free_.size(); ++i) {
    values[free_[i].index].number = free_values[i];
    values[free_[i].index].given = 1;
  }
  for (std::size_t m = 0; maps != nullptr && m < maps->maps().size(); ++m) {
    const MapParameter& map = maps->maps()[m].parameter;
    values[map.index].text = maps->file().c_str();
    values[map.dataset].text = map.name.c_str();
    values[map.index].given = values[map.dataset].given = 1;
  }
  return std::make_shared<const simulation::Effect>(*descriptor_, values.data(), camera);
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
      const std::string shown = written_->text_of(p.name);
      text +=
          fmt::format(", {}: {}", p.name, core::yaml_word(shown.empty() ? written_->shown()[p.name].dump() : shown));
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
  for (const Term& term : terms) effects.push_back(term.candidate->make(term.values, camera, term.maps.get()));
  return {camera, physical, std::move(effects)};
}

}  // namespace tofgraph::diagnosis
