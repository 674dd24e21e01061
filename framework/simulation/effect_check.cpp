// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/effect_check.hpp"

#include "graph/parameters.hpp"
#include "graph/validation.hpp"
#include "simulation/board.hpp"
#include "simulation/forward_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tofgraph::simulation {
namespace {

std::vector<double> taps_with(const tofgraph_camera& camera, std::vector<EffectPtr> effects) {
  const ForwardModel model(camera, false, std::move(effects));
  Acquisition acquisition = acquisition_of(camera, 1e-3);
  acquisition.condition.ambient = "lamp";  // conditions on which effects may depend
  acquisition.condition.time_since_power_on = 600;
  acquisition.condition.velocity = 0.1;
  const Tracer board = board_tracer(camera.focal_length, {1.3, 0.1, 0.05, 0.85});
  return model.expect(board, acquisition, superpixels(camera, 8, 8)).taps;
}

/// Default values, with `which` where a parameter has such a value.
std::vector<tofgraph_value> values_at(const graph::Plugin& effect, const graph::ParameterValues& defaults,
                                      double tofgraph_parameter::*which) {
  std::vector<tofgraph_value> values(defaults.data(), defaults.data() + effect.parameter_count);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const tofgraph_parameter& p = effect.own_parameters[i];
    if (p.kind == TOFGRAPH_KIND_NUMBER && std::isfinite(p.*which)) values[i].number = p.*which;
  }
  return values;
}

}  // namespace

std::string defect_of(const graph::Plugin& effect, const tofgraph_camera& camera) {
  const auto has_off = [](const tofgraph_parameter& p) { return std::isfinite(p.off); };
  if (std::ranges::none_of(effect.own_parameters, has_off)) return {};
  config::Diagnostics unused;
  const graph::ParameterValues defaults(effect, {}, {}, unused);
  const auto seen_at = [&](double tofgraph_parameter::*which) {
    const auto values = values_at(effect, defaults, which);
    return taps_with(camera, {std::make_shared<const Effect>(effect, values.data(), camera)});
  };
  try {
    const std::vector<double> ideal = taps_with(camera, {});
    if (seen_at(&tofgraph_parameter::off) != ideal) return "changes the light although all its sizes are off";
    const std::vector<double> typical = seen_at(&tofgraph_parameter::typical);
    for (std::size_t i = 0; i < ideal.size(); ++i) {
      if (std::isfinite(ideal[i]) && !std::isfinite(typical[i]))
        return "turns finite light into NaN or infinity at its typical values";
    }
  } catch (const EffectError&) {
    return {};  // the effect reports its own requirements
  } catch (const std::invalid_argument&) {
    return {};  // the profile lacks lengths or gain
  }
  return {};
}

void validate_effects(const Model& model, const tofgraph_camera& camera, config::Diagnostics& diagnostics) {
  if (!graph::validating() || !diagnostics.ok()) return;
  for (const ModelEffect& effect : model.effects) {
    const std::string defect = defect_of(*effect.descriptor, camera);
    if (defect.empty()) continue;
    diagnostics.error(effect.at, fmt::format("the effect {} {}", effect.descriptor->name, defect),
                      fmt::format("this is a bug in the plugin {}", effect.descriptor->file.path.string()));
  }
}

}  // namespace tofgraph::simulation
