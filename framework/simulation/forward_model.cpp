// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/forward_model.hpp"

#include "simulation/evaluation.hpp"

#include <tofgraph/physics/exposures.hpp>

#include <algorithm>
#include <utility>

namespace tofgraph::simulation {

ForwardModel::ForwardModel(const tofgraph_camera& camera, bool physical, std::vector<EffectPtr> effects,
                           std::size_t edge_samples)
    : camera_(camera),
      physical_(physical),
      exposures_(physics::exposures_of(camera).size()),
      effects_(std::move(effects)),
      edge_samples_(edge_samples) {
  static_cast<void>(physics::geometry_of(camera));  // throws if values are missing
  const auto need = [&](double value, const char* what) {
    if (value > 0) return;
    throw std::invalid_argument(std::string("the profile of the camera '") + camera.name + "' has no " + what);
  };
  need(camera.gain, "gain, e.g. gain: 7.0e6 counts m^2/s");
  need(camera.contrast, "contrast, e.g. contrast: 0.5");
  need(camera.modulation_frequency, "modulation_frequency, e.g. modulation_frequency: 20 MHz");
  std::ranges::stable_sort(effects_, {}, [](const EffectPtr& e) { return std::pair(e->level(), e->late()); });
  const auto readout =
      std::ranges::find_if(effects_, [](const EffectPtr& e) { return e->level() == TOFGRAPH_LEVEL_TAPS && e->late(); });
  first_readout_ = static_cast<std::size_t>(readout - effects_.begin());
}

namespace {

/// Some rows of an image.
Pixels strip_of(const Pixels& pixels, std::size_t first, std::size_t last) {
  const auto part = [&](const auto& all, std::size_t each) {
    const auto at = [&](std::size_t row) {
      return all.begin() + static_cast<std::ptrdiff_t>(row * pixels.columns * each);
    };
    return std::decay_t<decltype(all)>(at(first), at(last));
  };
  return {last - first, pixels.columns, pixels.spacing, part(pixels.at, 2), part(pixels.rays, 1)};
}

}  // namespace

Expectation ForwardModel::expect(const Tracer& tracer, const Acquisition& acquisition, const Pixels& pixels) const {
  if (acquisition.moving && !(camera_.frame_rate > 0))
    throw std::invalid_argument(std::string("the profile of the camera '") + camera_.name +
                                "' has no frame_rate, which a moving scene needs, e.g. frame_rate: 80 Hz");
  const auto evaluate = [&](const Pixels& some) {
    Evaluation evaluation(*this, tracer, acquisition, some, {});
    evaluation.illuminate();
    return evaluation.integrate();
  };
  // A strip fits into the processor's cache; effects of neighbouring pixels need the whole image.
  constexpr std::size_t rows = 10;
  const bool whole = std::ranges::any_of(effects_, [](const EffectPtr& e) { return e->looks_at_neighbours(); });
  if (whole || pixels.rows <= 2 * rows) return evaluate(pixels);
  Expectation result;
  const std::size_t n = pixels.size();
  result.taps.resize(2 * exposures_ * n);
  result.hits.resize(n);
  for (std::size_t first = 0; first < pixels.rows; first += rows) {
    const std::size_t last = std::min(first + rows, pixels.rows);
    // Includes the adjacent rows, which are needed for detecting edges.
    const std::size_t above = first > 0 ? 1 : 0, below = last < pixels.rows ? 1 : 0;
    const Pixels strip = strip_of(pixels, first - above, last + below);
    const Expectation part = evaluate(strip);
    const std::size_t count = (last - first) * pixels.columns, from = above * pixels.columns;
    for (std::size_t plane = 0; plane < 2 * exposures_; ++plane)
      std::copy_n(part.taps.begin() + static_cast<std::ptrdiff_t>(plane * strip.size() + from), count,
                  result.taps.begin() + static_cast<std::ptrdiff_t>(plane * n + first * pixels.columns));
    if (!part.removed.empty()) result.removed.resize(exposures_ * n);
    for (std::size_t k = 0; k < exposures_ && !part.removed.empty(); ++k)
      std::copy_n(part.removed.begin() + static_cast<std::ptrdiff_t>(k * strip.size() + from), count,
                  result.removed.begin() + static_cast<std::ptrdiff_t>(k * n + first * pixels.columns));
    std::copy_n(part.hits.begin() + static_cast<std::ptrdiff_t>(from), count,
                result.hits.begin() + static_cast<std::ptrdiff_t>(first * pixels.columns));
    result.noise_factor = part.noise_factor;
  }
  return result;
}

void ForwardModel::read_out(const Acquisition& acquisition, const Pixels& pixels, std::span<double> taps) const {
  static const Tracer nothing;
  Evaluation evaluation(*this, nothing, acquisition, pixels, {});
  evaluation.use_taps(taps);
  for (std::size_t e = first_readout_; e < effects_.size(); ++e) effects_[e]->apply(evaluation);
}

}  // namespace tofgraph::simulation
