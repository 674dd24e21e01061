// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/model/candidate.hpp"

#include <fmt/format.h>

#include "config/json_text.hpp"
#include "diagnosis/data/design.hpp"
#include "graph/stream.hpp"
#include "io/image_file.hpp"

#include <tofgraph/physics/constants.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
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

/// Values of a nonlinear parameter to try: around the circle for an angle, else multiples of the typical value.
std::vector<double> tried(const FreeParameter& nonlinear, NonlinearRange range) {
  constexpr double turn = 2 * std::numbers::pi;
  if (nonlinear.is_angle()) {
    constexpr int steps = 6;
    std::vector<double> values;
    for (int i = 0; i < steps; ++i) values.push_back(nonlinear.minimum + turn * i / steps);
    return values;
  }
  static constexpr std::array factors = {1.0, 0.3, 3.0, 10.0, 30.0};
  return nonlinear.multiples(std::span(factors).first(range == NonlinearRange::usual ? 3 : factors.size()));
}

}  // namespace

double FreeParameter::step() const {
  const double up = std::min(off + std::abs(typical), maximum) - off,
               down = std::max(off - std::abs(typical), minimum) - off;
  return up >= -down ? up : down;
}

bool FreeParameter::is_angle() const {
  return nonlinear && unit == "rad" && maximum - minimum > 0.99 * 2 * std::numbers::pi;
}

std::vector<double> FreeParameter::multiples(std::span<const double> factors) const {
  std::vector<double> values;
  for (const double factor : factors) {
    const double value = std::clamp(factor * typical, minimum, maximum);
    if (!contains(values, value)) values.push_back(value);
  }
  return values;
}

double MapParameter::bound(const Design& design) const {
  constexpr double any_full_well = 65535;
  const tofgraph_camera& camera = design.camera();
  const double full_well = std::isfinite(camera.full_well) ? camera.full_well : any_full_well;
  if (unit == "m") return physics::unambiguous_range(camera.modulation_frequency) / 2;
  if (unit == "counts") return full_well;
  if (unit == "counts/s")
    return full_well / std::ranges::max(design.conditions(), {}, &io::Condition::integration_time).integration_time;
  return unit.empty() ? 1 : std::numeric_limits<double>::infinity();
}

EstimatedMaps::EstimatedMaps(std::vector<Map> maps, double dimension, std::size_t grid, const tofgraph_camera& camera)
    : maps_(std::move(maps)), dimension_(dimension) {
  for (const Map& map : maps_) {
    std::vector<double>& values = pixels_.emplace_back(std::size_t{camera.width} * camera.height);
    for (std::size_t p = 0; p < values.size(); ++p)
      values[p] = map.values[superpixel_of(p, camera.height, camera.width, grid)];
    images_.push_back(io::image_view(values.data(), camera.height, camera.width, map.parameter.name.c_str(),
                                     map.parameter.unit.c_str()));
  }
}

Candidate::Candidate(const graph::Plugin& plugin)
    : descriptor_(&plugin), owned_(defaults_of(plugin)), written_(owned_.get()) {
  find_free();
  find_maps();
  find_refinements();
}

Candidate::Candidate(const simulation::ModelEffect& effect, std::vector<std::size_t> held)
    : descriptor_(effect.descriptor), written_(&effect.values), held_(std::move(held)) {
  find_free();
  find_refinements();
}

Candidate::Candidate(const Candidate& root, std::size_t refined)
    : descriptor_(root.descriptor_), written_(root.written_), root_(&root), refined_(refined), free_(root.free_) {
  for (std::size_t r = 0; r < refinements().size(); ++r) {
    if (this->refined(r)) std::ranges::copy(refinements()[r].parameters, std::back_inserter(free_));
  }
}

FreeParameter Candidate::parameter(std::size_t i) const {
  const tofgraph_parameter& p = descriptor_->parameters[i];
  const bool nonlinear = !std::isfinite(p.off);
  const auto bound = [](double value, double none) { return std::isnan(value) ? none : value; };
  return {i,
          p.name,
          p.unit,
          nonlinear,
          nonlinear ? p.typical : p.off,
          p.typical,
          bound(p.minimum, -std::numeric_limits<double>::infinity()),
          bound(p.maximum, std::numeric_limits<double>::infinity())};
}

void Candidate::find_free() {
  for (std::uint64_t i = 0; i < descriptor_->parameter_count; ++i) {
    const tofgraph_parameter& p = descriptor_->parameters[i];
    const bool nested = (p.flags & TOFGRAPH_PARAMETER_NESTED) != 0;
    if (contains(held_, i)) continue;
    if (p.kind == TOFGRAPH_KIND_NUMBER && std::isfinite(p.typical) && !nested) free_.push_back(parameter(i));
  }
  // Without an amplitude parameter there is nothing to search: nonlinear ones alone change nothing.
  if (amplitudes() == 0) free_.clear();
}

void Candidate::find_refinements() {
  constexpr std::size_t most = 8;  // there is a variant for each combination of them
  for (std::uint64_t i = 0; i < descriptor_->parameter_count && !free_.empty(); ++i) {
    const tofgraph_parameter& p = descriptor_->parameters[i];
    if (p.kind != TOFGRAPH_KIND_NUMBER || (p.flags & TOFGRAPH_PARAMETER_NESTED) == 0) continue;
    FreeParameter one = parameter(i);
    if (!one.nonlinear) {
      if (refinements_.size() == most) break;
      one.off = written_->data()[i].number;  // the value of the model counts as off
      refinements_.push_back({p.name, {}});
    }
    if (!refinements_.empty()) refinements_.back().parameters.push_back(std::move(one));
  }
  for (std::size_t bits = 1; bits < std::size_t{1} << refinements_.size(); ++bits)
    variants_.push_back(std::unique_ptr<Candidate>(new Candidate(*this, bits)));
}

std::size_t Candidate::first_parameter_of(std::size_t refinement) const {
  std::size_t at = root_->free_.size();
  for (std::size_t r = 0; r < refinement; ++r) at += refined(r) ? refinements()[r].parameters.size() : 0;
  return at;
}

void Candidate::find_maps() {
  if (free_.size() != 1 || free_.front().nonlinear || free_.front().off != 0) return;
  for (std::uint64_t i = 0; i < descriptor_->parameter_count; ++i) {
    const tofgraph_parameter& p = descriptor_->parameters[i];
    if (p.kind == TOFGRAPH_KIND_IMAGE && written_->data()[i].given == 0) maps_.push_back({i, p.name, p.unit});
  }
}

std::size_t Candidate::amplitudes() const {
  return static_cast<std::size_t>(std::ranges::count(free_, false, &FreeParameter::nonlinear));
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

std::vector<std::vector<double>> combinations(std::span<const std::vector<double>> values) {
  std::vector<std::vector<double>> all(1);
  for (const std::vector<double>& next : values) {
    std::vector<std::vector<double>> longer;
    for (const std::vector<double>& before : all) {
      for (const double value : next) {
        longer.push_back(before);
        longer.back().push_back(value);
      }
    }
    all = std::move(longer);
  }
  return all;
}

std::vector<std::vector<double>> starts_of_nonlinear(std::span<const FreeParameter> parameters, NonlinearRange range) {
  std::vector<std::vector<double>> values;
  for (const FreeParameter& p : parameters)
    values.push_back(p.nonlinear ? tried(p, range) : std::vector<double>{p.off});
  return combinations(values);
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
      const nlohmann::json& shown = written_->shown()[p.name];  // an object is written as a YAML map
      text += fmt::format(", {}: {}", p.name,
                          shown.is_string() ? config::yaml_word(shown.get<std::string>()) : config::json_text(shown));
    }
  }
  for (std::size_t m = 0; maps != nullptr && m < maps->maps().size(); ++m) {
    const MapParameter& map = maps->maps()[m].parameter;
    text += fmt::format(", {}: {{file: {}, dataset: {}}}", map.name, map_file, map_dataset(map));
  }
  return text + "}";
}

bool lists_as_confusable(const Candidate& one, const Candidate& other) {
  const std::vector<std::string> names = graph::split_words(one.border().confused_with);
  return contains(names, other.name());
}

std::vector<std::string> confused_with(const Candidate& one, const Candidates& candidates) {
  std::vector<std::string> names = graph::split_words(one.border().confused_with);
  for (const auto& other : candidates) {
    if (lists_as_confusable(*other, one)) names.push_back(other->name());
  }
  return names;
}

std::span<const double> values_of(const Term& term, const ModelTerm& addition) {
  if (!addition.refinement) return term.values;
  const std::size_t count = term.candidate->refinements()[*addition.refinement].parameters.size();
  return std::span(term.values).subspan(term.candidate->first_parameter_of(*addition.refinement), count);
}

std::string name_of(const Term& term, const ModelTerm& addition) {
  const std::string name = term.candidate->name();
  return addition.refinement ? name + "." + term.candidate->refinements()[*addition.refinement].name : name;
}

Term refined(Term term, std::size_t refinement, std::span<const double> values) {
  const auto at = static_cast<std::ptrdiff_t>(term.candidate->first_parameter_of(refinement));
  term.values.insert(term.values.begin() + at, values.begin(), values.end());
  term.candidate = &term.candidate->with(refinement);
  return term;
}

Term coarser(Term term, std::size_t refinement) {
  const auto first = term.values.begin() + static_cast<std::ptrdiff_t>(term.candidate->first_parameter_of(refinement));
  const std::size_t count = term.candidate->refinements()[refinement].parameters.size();
  term.values.erase(first, first + static_cast<std::ptrdiff_t>(count));
  term.candidate = &term.candidate->without(refinement);
  return term;
}

simulation::ForwardModel forward_model(std::span<const Term> terms, const tofgraph_camera& camera, bool physical) {
  std::vector<simulation::EffectPtr> effects;
  for (const Term& term : terms) effects.push_back(term.candidate->make(term.values, camera, term.maps));
  return {camera, physical, std::move(effects)};
}

}  // namespace tofgraph::diagnosis
