// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Selects the effects that are corrected, and the inputs that this requires.
#include "simulation/correction.hpp"

#include "config/quantity.hpp"
#include "simulation/correction_views.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tofgraph::simulation {
namespace {

/// Camera with the changes made by geometry effects.
std::shared_ptr<const io::Camera> changed_camera(const tofgraph_camera& camera, const std::vector<EffectPtr>& effects) {
  const Acquisition acquisition = acquisition_for(camera, {});
  std::vector<tofgraph_source_light> sources;
  for (const tofgraph_light& light : lights_of(camera))
    sources.push_back({light.name, {light.position[0], light.position[1], light.position[2]}, 1, nullptr, {}, {}});
  tofgraph_light_state state{};
  state.size = sizeof state;
  state.source_size = sizeof(tofgraph_source_light);
  state.exposure_size = sizeof(tofgraph_exposure);
  state.camera = &camera;
  state.condition = &acquisition.condition;
  state.frequency = camera.modulation_frequency;
  state.sources = sources.data();
  state.source_count = sources.size();
  for (const EffectPtr& effect : effects) effect->apply(state);
  tofgraph_camera changed = camera;
  for (std::size_t i = 0; i < 5; ++i) changed.distortion[i] += state.distortion[i];
  for (std::size_t i = 0; i < 2; ++i) changed.principal_point[i] += state.principal_point[i];
  std::vector<tofgraph_light> lights;
  for (const tofgraph_light& light : lights_of(camera)) lights.push_back(light);
  for (std::size_t s = 0; s < lights.size(); ++s) std::copy_n(sources[s].position, 3, lights[s].position);
  changed.lights = lights.data();
  changed.light_size = sizeof(tofgraph_light);
  const bool same_lens = std::ranges::all_of(state.distortion, [](double d) { return d == 0; }) &&
                         std::ranges::all_of(state.principal_point, [](double d) { return d == 0; });
  if (!same_lens) changed.rays = nullptr;  // recomputed
  return std::make_shared<const io::Camera>(changed);
}

/// Largest relative change of any pattern by an image effect, over pixels around the centre: below 1 the fixed-point
/// iteration converges.
double max_change(const tofgraph_camera& camera, bool physical, const EffectPtr& effect) {
  constexpr std::size_t size = 48;
  const CameraInverse inverse(camera, physical, {effect});
  const Pixels some =
      window(inverse.pixels(), std::min<std::size_t>(size, camera.height), std::min<std::size_t>(size, camera.width));
  const Acquisition acquisition = acquisition_for(camera, {});
  PhasorImage pattern = random_phasors(some.size());
  double change = 0;
  constexpr int steps = 12;
  for (int step = 0; step < steps; ++step) {
    const PhasorImage seen = look(inverse, acquisition, some, pattern);
    const double before = norm_of(pattern);
    for (std::size_t i = 0; i < pattern.size(); ++i) pattern[i] = seen[i] - pattern[i];
    change = norm_of(pattern) / before;
    if (change < 1e-9) break;
    const double scale = before / norm_of(pattern);
    for (std::complex<double>& value : pattern) value *= scale;
  }
  return change;
}

/// Returns true if any distances differ by more than 0.1 um, modulo the range.
bool differ(const Measurements& one, const Measurements& other, double range) {
  for (std::size_t i = 0; i < one.distance.size(); ++i) {
    if (!(std::abs(std::remainder(one.distance[i] - other.distance[i], range)) < 1e-7)) return true;
  }
  return false;
}

/// Returns true if an effect alone changes distances.
bool changes_distances(const tofgraph_camera& camera, bool physical, const EffectPtr& effect) {
  const CameraInverse inverse(camera, physical, {effect});
  const Acquisition acquisition = acquisition_for(camera, {});
  Views views = some_views(inverse);
  for (std::uint32_t pixel = 0; pixel < inverse.pixels().size(); ++pixel) {  // a map may affect few pixels
    constexpr double distance = 1.5, amplitude = 1000;
    if (std::isnan(inverse.pixels().rays[pixel].z)) continue;
    views.pixel.push_back(pixel);
    views.return_path.push_back(inverse.return_path_at(pixel, distance));
    views.reflectivity.push_back(inverse.reflectivity_for(amplitude, distance, acquisition.condition.integration_time));
  }
  return differ(inverse.measure(acquisition, views), inverse.measure(acquisition, views, false),
                inverse.range(acquisition));
}

std::string length_text(double metres) { return config::format_quantity(std::round(metres * 1e3) * 1e-3, "m"); }

}  // namespace

Correction::Correction(const tofgraph_camera& camera, bool physical, const std::vector<EffectPtr>& effects)
    : camera_(std::make_shared<const io::Camera>(camera)) {
  choose(physical, effects);
  find_needs();
  require_monotone(physical, pixels_->model().effects());
}

void Correction::choose(bool physical, const std::vector<EffectPtr>& effects) {
  std::vector<EffectPtr> geometry, single, all;
  bool images = false;
  constexpr double undoable = 0.5;  // gain of a pattern, and of its noise, is limited to 2
  for (const EffectPtr& effect : effects) {
    const auto tell = [&](bool undone, std::string how) {
      treatments_.push_back({effect->name(), undone, std::move(how)});
    };
    if (effect->border().scope == TOFGRAPH_SCOPE_SETUP) {
      tell(false, "belongs to the set-up, not to the camera");
    } else if (effect->level() == TOFGRAPH_LEVEL_GEOMETRY) {
      geometry.push_back(effect);
      tell(true, "the frames have the corrected camera");
    } else if (!effect->looks_at_neighbours()) {
      single.push_back(effect);
      all.push_back(effect);
      const bool changes = changes_distances(camera_->view(), physical, effect);
      tell(changes, changes ? "each pixel's distance is corrected" : "does not change the distance");
    } else if (max_change(camera_->view(), physical, effect) < undoable) {
      all.push_back(effect);
      images = true;
      tell(true, "taken off the whole image, step by step");
    } else {
      tell(false, "mixes neighbours so much that undoing it would make noise stronger than what is corrected");
    }
  }
  if (!geometry.empty()) {
    camera_ = changed_camera(camera_->view(), geometry);
    changed_ = true;
  }
  pixels_ = std::make_unique<const CameraInverse>(camera_->view(), physical, single);
  if (images) images_ = std::make_unique<const CameraInverse>(camera_->view(), physical, all);
}

void Correction::find_needs() {
  const tofgraph_camera& camera = camera_->view();
  const Views views = some_views(*pixels_);
  const auto changes = [&](const FrameSettings& settings, double light) {
    Views changed = views;
    const Acquisition usual = acquisition_for(camera, {}), other = acquisition_for(camera, settings);
    const double time = usual.condition.integration_time / other.condition.integration_time;
    for (double& reflectivity : changed.reflectivity) reflectivity *= light * time;
    return differ(pixels_->measure(usual, views), pixels_->measure(other, changed), pixels_->range(usual));
  };
  needs_.amplitude = changes({}, 0.2) || changes({}, 5) || images_ != nullptr;
  // Scans the whole operating range, because a table or a step may be anywhere in it.
  const auto matters = [&](double FrameSettings::*what, double first, double last, const auto& next) {
    for (double value = first; value < last; value = next(value)) {
      FrameSettings settings;
      settings.*what = value;
      if (changes(settings, 1)) return true;
    }
    return false;
  };
  const double time = acquisition_for(camera, {}).condition.integration_time;
  needs_.integration_time =
      matters(&FrameSettings::integration_time, time / 4096, time * 5000, [](double t) { return t * 1.4; });
  needs_.time_since_power_on = matters(&FrameSettings::time_since_power_on, 0.5, 2e5, [](double t) { return t * 2; });
  needs_.temperature = matters(&FrameSettings::temperature, 230, 360, [](double kelvin) { return kelvin + 2.5; });
}

void Correction::require_monotone(bool physical, const std::vector<EffectPtr>& effects) const {
  const Acquisition acquisition = acquisition_for(camera_->view(), {});
  const auto fold = first_fold(*pixels_, acquisition);
  if (!fold) return;
  std::string culprits;
  for (const EffectPtr& effect : effects) {
    if (first_fold(CameraInverse(camera_->view(), physical, {effect}), acquisition))
      culprits += (culprits.empty() ? "" : ", ") + effect->name();
  }
  throw std::invalid_argument(fmt::format(
      "cannot be undone: between {} and {} the measured distance falls while the true one rises, so that one measured "
      "distance stands for several true ones ({})",
      length_text(fold->from), length_text(fold->to),
      culprits.empty() ? "by the effects together" : "by the effect " + culprits));
}

}  // namespace tofgraph::simulation
