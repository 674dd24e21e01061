// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Geometry and phasor level: the light that reaches each pixel.
#include "simulation/evaluation.hpp"

#include <tofgraph/physics/exposures.hpp>
#include <tofgraph/physics/reflectance.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::simulation {
Evaluation::Evaluation(const ForwardModel& model, const Tracer& tracer, const Acquisition& acquisition,
                       const Pixels& pixels, const BoardChange& moved, double modulation)
    : tofgraph_light_state{},
      model_(model),
      tracer_(tracer),
      acquisition_(acquisition),
      pixels_(pixels),
      moved_(moved) {
  size = sizeof(tofgraph_light_state);
  source_size = sizeof(tofgraph_source_light);
  camera = &model.camera();
  condition = &acquisition.condition;
  physical = model.physical() ? 1 : 0;
  rows = pixels.rows;
  columns = pixels.columns;
  spacing = pixels.spacing;
  noise_factor = 1;
  steps_ = physics::exposures_of(*camera);
  frequencies_ = physics::frequencies_of(steps_, condition->modulation_frequency);
  for (std::size_t k = 0; k < steps_.size(); ++k) steps_[k].frequency = frequencies_[k];
  frequency = modulation > 0 ? modulation : frequencies_.front();
  exposure_size = sizeof(tofgraph_exposure);
  exposures = steps_.data();
  exposure_count = steps_.size();
}

void Evaluation::illuminate() {
  place_sources();
  apply_level(TOFGRAPH_LEVEL_GEOMETRY);
  trace();
  emit();
  for (std::size_t e = 0; e < model_.effects().size(); ++e) {
    const Effect& effect = *model_.effects()[e];
    if (effect.level() != TOFGRAPH_LEVEL_PHASOR || effect.late()) continue;
    if (effect.looks_at_neighbours()) merge_edges();
    effect.apply(*this);
  }
  merge_edges();
  sum();
  for (const EffectPtr& effect : model_.effects()) {
    if (effect->level() == TOFGRAPH_LEVEL_PHASOR && effect->late()) effect->apply(*this);
  }
  for (std::size_t i = 0; i < light_.size(); ++i) {
    if (turns_[i] != 0 && light_[i] != Complex{}) light_[i] *= std::polar(1.0, turns_[i]);
  }
}

void Evaluation::apply_level(std::uint32_t level) {
  for (const EffectPtr& effect : model_.effects()) {
    if (effect->level() == level) effect->apply(*this);
  }
}

void Evaluation::place_sources() {
  const std::size_t n = camera->light_count;
  for (const tofgraph_light& light : lights_of(*camera)) {
    const std::size_t s = borders_.size();
    const bool on = acquisition_.on.empty() || acquisition_.on[s];
    borders_.push_back({light.name,
                        {light.position[0], light.position[1], light.position[2]},
                        on ? 1.0 : 0.0,
                        nullptr,
                        nullptr,
                        nullptr});
  }
  borders_.push_back({"", {0, 0, 0}, 1, nullptr, nullptr, nullptr});
  sources = borders_.data();
  source_count = n;  // the internal source has no position
  scale = offset = tilt[0] = tilt[1] = 0;
}

Vector3 Evaluation::ray_at(const physics::Lens& lens, double u, double v) const {
  const auto p = physics::image_point(*camera, lens, u - principal_point[0], v - principal_point[1]);
  const Vector3 along = p ? Vector3{p->x, p->y, 1} : Vector3{io::unknown, io::unknown, io::unknown};
  return (1 / physics::norm(along)) * along;
}

void Evaluation::trace_rays(const std::vector<Vector3>& rays, std::vector<Hit>& hits) const {
  BoardChange change = moved_;
  change.scale = 1 + scale;
  change.offset = offset;
  change.tilt_x = tilt[0];
  change.tilt_y = tilt[1];
  hits.assign(rays.size(), {});
  tracer_(change, rays, hits);
}

void Evaluation::trace() {
  const bool other_lens = std::ranges::any_of(distortion, [](double d) { return d != 0; }) || principal_point[0] != 0 ||
                          principal_point[1] != 0;
  tofgraph_camera changed = *camera;
  for (std::size_t i = 0; i < 5; ++i) changed.distortion[i] += distortion[i];
  const physics::Lens lens(changed);
  std::vector<Vector3> bent;
  for (std::size_t i = 0; other_lens && i < pixels_.size(); ++i)
    bent.push_back(ray_at(lens, pixels_.at[2 * i], pixels_.at[2 * i + 1]));
  const std::vector<Vector3>& rays = other_lens ? bent : pixels_.rays;
  trace_rays(rays, hits_);
  points_.resize(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i)
    points_.set(i, pixels_.at[2 * i], pixels_.at[2 * i + 1], rays[i], hits_[i], camera->focal_length);
  if (model_.edge_samples() > 1 && spacing == 1) add_edges(lens);
  points = points_.size();
  pixel = points_.pixel.data();
  ray = points_.ray.data();
  position = points_.position.data();
  normal = points_.normal.data();
  return_path = points_.return_path.data();
  sensor_path = points_.sensor_path.data();
  reflectivity = points_.reflectivity.data();
}

void Evaluation::add_edges(const physics::Lens& lens) {
  edges_ = edge_pixels(hits_, rows, columns);
  const std::size_t n = model_.edge_samples();
  std::vector<Vector3> rays;
  std::vector<double> at;
  for (const std::size_t i : edges_) {
    for (std::size_t s = 0; s < n * n; ++s) {
      const std::size_t along = s % n, down = s / n;
      const double u = pixels_.at[2 * i] + (static_cast<double>(along) + 0.5) / static_cast<double>(n) - 0.5;
      const double v = pixels_.at[2 * i + 1] + (static_cast<double>(down) + 0.5) / static_cast<double>(n) - 0.5;
      at.insert(at.end(), {u, v});
      rays.push_back(ray_at(lens, u, v));
    }
  }
  std::vector<Hit> hits;
  trace_rays(rays, hits);
  const std::size_t first = points_.size();
  points_.resize(first + rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i)
    points_.set(first + i, at[2 * i], at[2 * i + 1], rays[i], hits[i], camera->focal_length);
}

void Evaluation::emit() {
  const std::size_t n = points_.size(), lights = camera->light_count;
  arrays_.resize(lights + 1);
  for (SourceArrays& a : arrays_) {
    a.strength.assign(n, 0);
    a.phasor.assign(n, {});
  }
  double all = 0;
  for (std::size_t s = 0; s < lights; ++s) all += camera->lights[s].amplitude;
  const bool dark = (acquisition_.condition.flags & TOFGRAPH_CONDITION_LENS_CAPPED) != 0;
  for (std::size_t s = 0; s < lights; ++s) {
    arrays_[s].path.resize(n);
    const Vector3 place{borders_[s].position[0], borders_[s].position[1], borders_[s].position[2]};
    for (std::size_t i = 0; i < n; ++i) arrays_[s].path[i] = physics::norm(points_.position_of(i) - place);
  }
  if (!dark) {
    for (std::size_t i = 0; i < n; ++i) {
      if (points_.return_path[i] > 0) emit_at(i, all);
    }
  }
  for (std::size_t s = 0; s <= lights; ++s) {
    borders_[s].path = s < lights ? arrays_[s].path.data() : nullptr;
    borders_[s].phasor = reinterpret_cast<double*>(arrays_[s].phasor.data());
    borders_[s].strength = arrays_[s].strength.data();
  }
  source_count = lights + 1;
  turns_.assign(n, 0);
  phase_offset = turns_.data();
}

void Evaluation::emit_at(std::size_t i, double all) {
  const std::size_t lights = camera->light_count;
  const double common = points_.return_path[i] + points_.sensor_path[i];
  const double amount = camera->gain * points_.reflectivity[i] * acquisition_.condition.integration_time;
  const double radians_per_metre = physics::two_pi * frequency / physics::speed_of_light;
  double mean = 0, weights = 0;
  for (std::size_t s = 0; s < lights; ++s) {
    const double weight = borders_[s].on * camera->lights[s].amplitude;
    mean += weight * arrays_[s].path[i];
    weights += weight;
  }
  const double travelled = mean / weights + common;
  for (std::size_t s = 0; s < lights; ++s) {
    const double weight = borders_[s].on * camera->lights[s].amplitude / all;
    if (weight == 0) continue;
    const double path = arrays_[s].path[i];
    double strength = weight * amount / (travelled * travelled);
    if (physical != 0) {
      const double view = points_.ray[3 * i + 2], view2 = view * view;
      strength = weight * amount * incidence(s, i) / (4 * path * path) * view2 * view2;
    }
    if (points_.surface[i] != nullptr) strength = finish_of(s, i, strength);
    arrays_[s].strength[i] = strength;
    arrays_[s].phasor[i] = std::polar(strength, radians_per_metre * (path + common));
  }
}

Vector3 Evaluation::to_source(std::size_t s, std::size_t i) const {
  const Vector3 place{borders_[s].position[0], borders_[s].position[1], borders_[s].position[2]};
  return (1 / arrays_[s].path[i]) * (place - points_.position_of(i));
}

double Evaluation::incidence(std::size_t s, std::size_t i) const {
  return std::max(0.0, physics::dot(to_source(s, i), points_.normal_of(i)));
}

double Evaluation::finish_of(std::size_t s, std::size_t i, double strength) const {
  const Surface& surface = *points_.surface[i];
  const Vector3 light = to_source(s, i), view = -1.0 * points_.ray_of(i), normal = points_.normal_of(i);
  const double white = points_.reflectivity[i] > 0 ? strength / points_.reflectivity[i] : 0;
  const double rough = surface.roughness > 0 ? physics::oren_nayar(surface.roughness, normal, light, view) : 1;
  const Vector3 half = light + view;
  const double along = std::max(0.0, physics::dot(normal, half) / physics::norm(half));
  return strength * rough + white * surface.specular * std::pow(along, surface.exponent);
}

void Evaluation::merge_edges() {
  const std::size_t n = pixels_.size(), each = model_.edge_samples() * model_.edge_samples();
  points = n;
  for (SourceArrays& a : arrays_) {
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      Complex phasor;
      double strength_sum = 0, path_sum = 0;
      for (std::size_t i = n + e * each; i < n + (e + 1) * each; ++i) {
        phasor += a.phasor[i];
        strength_sum += a.strength[i];
        if (!a.path.empty() && a.strength[i] > 0) path_sum += a.strength[i] * whole_path(a, i);
      }
      a.phasor[edges_[e]] = phasor / static_cast<double>(each);
      a.strength[edges_[e]] = strength_sum / static_cast<double>(each);
      if (path_sum > 0) a.edge_paths.emplace_back(edges_[e], path_sum / strength_sum);
    }
  }
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    double turn_sum = 0;
    for (std::size_t s = 0; s < each; ++s) turn_sum += turns_[n + e * each + s];
    turns_[edges_[e]] = turn_sum / static_cast<double>(each);
  }
  edges_.clear();
}

void Evaluation::sum() {
  const std::size_t n = pixels_.size();
  light_.assign(n, {});
  strength_.assign(n, 0);
  distances_.assign(n, 0);
  amplitudes_.resize(n);
  std::vector<double> weights(n, 0);
  for (std::size_t s = 0; s < arrays_.size(); ++s) {
    const SourceArrays& a = arrays_[s];
    for (std::size_t i = 0; i < n; ++i) {
      light_[i] += a.phasor[i];
      strength_[i] += a.strength[i];
      if (s == camera->light_count) continue;
      distances_[i] += a.strength[i] * (whole_path(a, i) / 2);
      weights[i] += a.strength[i];
    }
    for (const auto& [i, path] : a.edge_paths) distances_[i] += a.strength[i] * (path - whole_path(a, i)) / 2;
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (weights[i] > 0) distances_[i] /= weights[i];
    amplitudes_[i] = std::sqrt(std::norm(light_[i]));
    strength_[i] /= 2 * camera->contrast;
  }
  amplitude = amplitudes_.data();
  distance = distances_.data();
}

}  // namespace tofgraph::simulation
