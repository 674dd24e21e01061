// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/forward_model.hpp"

#include "simulation/evaluation.hpp"

#include <algorithm>

namespace tofgraph::simulation {

ForwardModel::ForwardModel(const tofgraph_camera& camera, bool physical, std::vector<EffectPtr> effects,
                           std::size_t edge_samples)
    : camera_(camera), physical_(physical), effects_(std::move(effects)), edge_samples_(edge_samples) {
  static_cast<void>(physics::geometry_of(camera));  // says what is missing
  const auto need = [&](double value, const char* what) {
    if (value > 0) return;
    throw std::invalid_argument(std::string("the profile of the camera '") + camera.name + "' has no " + what);
  };
  need(camera.gain, "gain, e.g. gain: 7.0e6 counts m^2/s");
  need(camera.contrast, "contrast, e.g. contrast: 0.5");
  need(camera.modulation_frequency, "modulation_frequency, e.g. modulation_frequency: 20 MHz");
  std::ranges::stable_sort(effects_, {}, [](const EffectPtr& e) { return e->level(); });
  const auto readout =
      std::ranges::find_if(effects_, [](const EffectPtr& e) { return e->level() == TOFGRAPH_TAPS && e->late(); });
  first_readout_ = static_cast<std::size_t>(readout - effects_.begin());
}

Expectation ForwardModel::expect(const Tracer& tracer, const Shot& shot, const Pixels& pixels) const {
  Evaluation evaluation(*this, tracer, shot, pixels, {});
  evaluation.shine();
  return evaluation.develop();
}

void ForwardModel::read_out(const Shot& shot, const Pixels& pixels, std::span<double> taps) const {
  static const Tracer nothing;
  Evaluation evaluation(*this, nothing, shot, pixels, {});
  evaluation.use_taps(taps);
  for (std::size_t e = first_readout_; e < effects_.size(); ++e) effects_[e]->apply(evaluation);
}

}  // namespace tofgraph::simulation
