// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/effects.hpp"

#include "config/quantity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

namespace tofgraph::hidden {
namespace {

const double none = std::numeric_limits<double>::infinity();

const Effect& kind_of(std::string_view name) {
  const auto found =
      std::find_if(catalogue().begin(), catalogue().end(), [&](const Effect& kind) { return kind.name == name; });
  if (found == catalogue().end())
    throw std::invalid_argument(fmt::format("there is no effect '{}'; --list shows all", name));
  return *found;
}

const Parameter& parameter_of(const Effect& kind, std::string_view name) {
  const auto found = std::find_if(kind.parameters.begin(), kind.parameters.end(),
                                  [&](const Parameter& parameter) { return parameter.name == name; });
  if (found == kind.parameters.end())
    throw std::invalid_argument(fmt::format("the effect {} has no parameter '{}'; it has, for example, {}", kind.name,
                                            name, kind.parameters.front().name));
  return *found;
}

}  // namespace

const std::vector<Effect>& catalogue() {
  using enum Draw;
  // The effects on the taps are listed in the order in which they act.
  static const std::vector<Effect> effects = {
      {"wiggling",
       {{"amplitude", "m", 0, 5e-3, scaled},
        {"phase", "rad", 0, 0, angle},
        {"amplitude5", "m", 0, 1.75e-3, scaled, true},
        {"phase5", "rad", 0, 0, turn, true},
        {"amplitude7", "m", 0, 1e-3, scaled, true},
        {"phase7", "rad", 0, 0, turn, true}}},
      {"even_harmonic", {{"ratio", "", 0, 0.02, either_sign}}},
      {"phase_step_error",
       {{"step1", "rad", 0, 5e-3, either_sign},
        {"step2", "rad", 0, 5e-3, either_sign},
        {"step3", "rad", 0, 5e-3, either_sign}}},
      {"phase_gain",
       {{"gain1", "", 0, 5e-3, either_sign}, {"gain2", "", 0, 5e-3, either_sign}, {"gain3", "", 0, 5e-3, either_sign}}},
      {"ambient_light", {{"rate", "counts/s", 0, 1e5, scaled}, {"suppression", "counts", none, none, unused}}},
      {"tap_mismatch", {{"ratio", "", 0, 0.02, either_sign}}},
      {"integration_time_offset",
       {{"slope", "m", 0, 8e-3, either_sign},
        {"reference_time", "s", 1e-3, 1e-3, constant},
        {"exponent", "", 0, 0.3, either_sign, true},
        {"linear", "m/s", 0, 0.4, either_sign, true}}},
      {"amplitude_walk",
       {{"logarithmic", "rad", 0, 8e-3, either_sign},
        {"inverse", "rad", 0, 3e-3, either_sign},
        {"reference_amplitude", "counts", 1000, 1000, constant}}},
      {"modulation_frequency", {{"error", "", 0, 1e-3, either_sign}}},
      {"crosstalk", {{"real", "counts/s", 0, 1500, either_sign}, {"imaginary", "counts/s", 0, 1500, either_sign}}},
      {"zero_offset", {{"offset", "m", 0, 20e-3, either_sign}}},
      {"static_reflection", {{"strength", "counts/s", 0, 1500, scaled}, {"distance", "m", 0.2, 0.2, constant}}},
      {"warm_up",
       {{"drift", "m", 0, 10e-3, either_sign},
        {"time_constant", "s", 720, 720, constant},
        {"droop", "", 0, 0.03, scaled},
        {"slow_drift", "m", 0, 3e-3, either_sign, true},
        {"slow_time_constant", "s", 14400, 14400, constant},
        {"exponent", "", 0, 0.3, either_sign, true},
        {"reference_time", "s", 1e-3, 1e-3, constant}}},
      {"fixed_pattern", {{"scale", "", 0, 1, scaled}}},
      {"pixel_response", {{"scale", "", 0, 1, scaled}}},
      {"adc_nonlinearity",
       {{"quadratic", "", 0, 0.03, scaled},
        {"cubic", "", 0, 0.02, scaled},
        {"full_scale", "counts", 30000, 30000, constant}}},
      {"saturation", {{"full_well", "counts", none, 8000, constant}}},
      {"temporal_noise", {{"factor", "", 1, 2, scaled}}},
      {"source_amplitude", {{"ratio", "", 0, 0.1, either_sign}}},
      {"source_phase", {{"difference", "rad", 0, 50e-3, either_sign}}},
      {"source_position",
       {{"separation", "m", 0, 4e-3, either_sign},
        {"shift", "m", 0, 4e-3, either_sign},
        {"depth", "m", 0, 4e-3, either_sign}}},
      {"beam_profile", {{"exponent", "", 0, 2, scaled}, {"toe", "rad", 0, 40e-3, within, true}}},
      {"vignetting", {{"exponent", "", 0, 4, scaled}}},
      {"surface_reflectance", {{"lambert", "", 0, 1, constant}, {"roughness", "rad", 0, 0.3, scaled}}},
      {"specular", {{"strength", "", 0, 0.3, scaled}, {"exponent", "", 60, 60, constant}}},
      {"lens_distortion",
       {{"k1", "", 0, -0.1, scaled},
        {"k2", "", 0, 0.03, either_sign, true},
        {"p1", "", 0, 1e-3, either_sign, true},
        {"p2", "", 0, 1e-3, either_sign, true},
        {"k3", "", 0, 0.02, either_sign, true}}},
      {"principal_point", {{"x", "px", 0, 1.2, either_sign}, {"y", "px", 0, 1.2, either_sign}}},
      {"board_tilt", {{"x", "rad", 0, 5e-3, either_sign}, {"y", "rad", 0, 5e-3, either_sign}}},
      {"rail_scale", {{"scale", "", 0, 1e-3, either_sign}}},
      {"rail_offset", {{"offset", "m", 0, 5e-3, either_sign}}},
      {"stray_light",
       {{"fraction", "", 0, 0.03, scaled}, {"width", "px", 35, 35, constant}, {"uniform", "", 0.5, 0.5, constant}}},
      {"multipath", {{"strength", "", 0, 0.03, scaled}, {"extra_path", "m", 0.5, 0.5, constant}}},
      {"rail_reflection", {{"strength", "", 0, 0.03, scaled}, {"height", "m", 0.4, 0.4, constant}}},
      {"mixed_pixels", {{"blur", "px", 0, 0.7, scaled}}},
      {"motion", {{"displacement", "m", 0, 1e-3, either_sign}}},
  };
  return effects;
}

void Effects::add(const std::string& name, const std::map<std::string, double>& values) {
  const Effect& kind = kind_of(name);
  if (has(name)) throw std::invalid_argument(fmt::format("the effect {} is declared twice", name));
  std::map<std::string, double> all;
  for (const Parameter& parameter : kind.parameters) all[parameter.name] = parameter.off;
  for (const auto& [key, value] : values) all[parameter_of(kind, key).name] = value;
  values_[name] = all;
}

void Effects::add_typical(const std::string& name, double size, std::uint64_t seed, Drawn drawn) {
  std::uint64_t mixed = seed;  // a separate draw for each effect of a campaign
  for (const char letter : name) mixed = mixed * 1099511628211ULL + static_cast<unsigned char>(letter);
  std::mt19937_64 random(mixed);
  std::map<std::string, double> values;
  for (const Parameter& parameter : kind_of(name).parameters) {
    // Drawn whether used or not: the parameters before and after it remain those of the seed.
    const double uniform = std::uniform_real_distribution<double>(0, 1)(random);
    if (parameter.further && drawn == Drawn::plain) continue;
    const double scaled = parameter.off + size * (parameter.typical - parameter.off);
    switch (parameter.draw) {
      case Draw::unused:
        break;
      case Draw::constant:
        values[parameter.name] = parameter.typical;
        break;
      case Draw::scaled:
        values[parameter.name] = scaled;
        break;
      case Draw::either_sign:
        values[parameter.name] = uniform < 0.5 ? -scaled : scaled;
        break;
      case Draw::within:
        values[parameter.name] = (2 * uniform - 1) * scaled;
        break;
      case Draw::angle:
        values[parameter.name] = 2 * M_PI * uniform;
        break;
      case Draw::turn:
        values[parameter.name] = (2 * uniform - 1) * M_PI;
        break;
    }
  }
  if (name == "saturation") values["full_well"] /= size;  // a smaller well is a larger effect
  add(name, values);
}

void Effects::add_text(std::string_view text, double size, std::uint64_t seed, Drawn drawn) {
  const std::size_t colon = text.find(':');
  const std::string name(text.substr(0, colon));
  if (colon == std::string_view::npos) return add_typical(name, size, seed, drawn);
  std::map<std::string, double> values;
  for (std::string_view rest = text.substr(colon + 1); !rest.empty();) {
    const std::size_t comma = std::min(rest.find(','), rest.size());
    const std::string_view item = rest.substr(0, comma);
    rest.remove_prefix(std::min(comma + 1, rest.size()));
    const std::size_t equals = item.find('=');
    if (equals == std::string_view::npos)
      throw std::invalid_argument(
          fmt::format("'{}' of {} is not a parameter; write it like amplitude=5mm", item, name));
    const Parameter& parameter = parameter_of(kind_of(name), item.substr(0, equals));
    const config::Quantity quantity = config::parse_quantity(item.substr(equals + 1), parameter.unit);
    if (!quantity.ok())
      throw std::invalid_argument(fmt::format("{} of {}: {}", parameter.name, name, quantity.problem));
    values[parameter.name] = quantity.value;
  }
  add(name, values);
}

double Effects::value(const std::string& effect, const std::string& parameter) const {
  const auto found = values_.find(effect);
  return found == values_.end() ? parameter_of(kind_of(effect), parameter).off : found->second.at(parameter);
}

}  // namespace tofgraph::hidden
