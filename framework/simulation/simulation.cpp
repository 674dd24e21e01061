// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/simulation.hpp"

#include "simulation/effect_check.hpp"

#include <fmt/format.h>
#include <tofgraph/physics/to_integer.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::simulation {
namespace {

physics::TapNoise noise_of(const SceneFile& scene) {
  const tofgraph_camera& camera = scene.camera->view();
  switch (scene.noise.from) {
    case SceneNoise::From::none:
      return {};
    case SceneNoise::From::scene:
      return {scene.noise.read_noise, scene.noise.shot_noise};
    default:
      return {camera.read_noise, camera.shot_noise};
  }
}

bool has_moving_object(const SceneCondition& condition) {
  return condition.objects && std::ranges::any_of(condition.objects->all, [](const Object& object) {
           return physics::norm(object.velocity) > 0;
         });
}

}  // namespace

Acquisition acquisition_of(const tofgraph_camera& camera, const Condition& condition) {
  Acquisition acquisition = acquisition_of(camera, condition.integration_time);
  tofgraph_condition& c = acquisition.condition;
  const auto flag = [](bool set, unsigned bit) { return set ? bit : 0U; };
  c.flags = flag(condition.reference == "laser", TOFGRAPH_CONDITION_LASER) |
            flag(condition.is_capped(), TOFGRAPH_CONDITION_LENS_CAPPED) |
            flag(condition.rail == "covered", TOFGRAPH_CONDITION_RAIL_COVERED);
  c.target = condition.target.c_str();
  c.ambient = condition.ambient.c_str();
  c.temperature = condition.temperature;
  c.time_since_power_on = condition.time_since_power_on;
  c.distance = condition.board_distance;
  c.tilt[0] = condition.board_tilt_x;
  c.tilt[1] = condition.board_tilt_y;
  c.roll = condition.roll;
  c.velocity = condition.velocity;
  for (std::uint64_t s = 0; s < camera.light_count && !condition.sources.empty(); ++s)
    acquisition.on.push_back(std::ranges::find(condition.sources, camera.lights[s].name) != condition.sources.end());
  acquisition.moving = std::isfinite(condition.velocity) && condition.velocity != 0;
  return acquisition;
}

std::vector<float> true_depth(const std::vector<Hit>& hits) {
  std::vector<float> depth;
  for (const Hit& hit : hits) depth.push_back(std::isfinite(hit.return_path) ? static_cast<float>(hit.point.z) : NAN);
  return depth;
}

std::unique_ptr<Simulation> Simulation::read(const std::filesystem::path& file, const graph::PluginRegistry& registry,
                                             const SimulationChanges& changes, config::Diagnostics& diagnostics) {
  SceneFile scene = read_scene(file, diagnostics);
  if (changes.seed) scene.seed = static_cast<std::int64_t>(*changes.seed);
  if (changes.frames) scene.frames = *changes.frames;
  if (!changes.output.empty()) scene.output = changes.output;
  const config::Value& document = scene.document;
  config::Diagnostics of_model;  // separate, so that errors in the scene do not hide those in the model
  Model model = changes.model.empty() ? model_of_scene(scene.model, registry, of_model)
                                      : load_model(changes.model, registry, of_model);
  std::vector<EffectPtr> effects;
  if (scene.camera) {
    const tofgraph_camera& camera = scene.camera->view();
    if (!is_for(model, *scene.camera))
      of_model.warning(document.at, fmt::format("the model is for the camera '{}', but the scene has '{}'",
                                                model.camera, camera.name));
    effects = make_effects(model, camera, of_model, changes.host);
    if (of_model.ok()) validate_effects(model, camera, of_model);
  }
  diagnostics.add(of_model.all());
  if (!diagnostics.ok()) return nullptr;
  load_assets(scene, diagnostics);
  if (!diagnostics.ok()) return nullptr;
  try {
    std::unique_ptr<Simulation> result(new Simulation(std::move(scene), std::move(model), std::move(effects)));
    if (changes.integration_time)
      for (SceneCondition& condition : result->conditions_) condition.integration_time = *changes.integration_time;
    return result;
  } catch (const std::invalid_argument& problem) {
    diagnostics.error(document.at, problem.what());
    return nullptr;
  }
}

Simulation::Simulation(SceneFile scene, Model model, std::vector<EffectPtr> effects)
    : scene_(std::move(scene)),
      model_(std::move(model)),
      pixels_(whole_image(camera())),
      forward_(camera(), model_.physical, std::move(effects), static_cast<std::size_t>(scene_.subpixels)),
      noise_(noise_of(scene_)),
      conditions_(expand(scene_)) {}

bool Simulation::has_output(std::string_view name) const {
  return std::ranges::find(scene_.output, name) != scene_.output.end();
}

std::unique_ptr<const ConditionFrames> Simulation::prepare(std::size_t index) const {
  const SceneCondition& condition = conditions_.at(index);
  const Tracer tracer = [&](const BoardChange& change, std::span<const Vector3> rays, std::span<Hit> hits) {
    make_world(scene_, condition, change).trace(rays, hits);
  };
  Acquisition acquisition = acquisition_of(camera(), condition);
  acquisition.moving = acquisition.moving || has_moving_object(condition);
  return std::unique_ptr<const ConditionFrames>(
      new ConditionFrames{condition, acquisition,
                          Frames(forward_, tracer, acquisition, pixels_, noise_,
                                 {seed(), static_cast<std::uint32_t>(index)}, has_output("taps"))});
}

tofgraph_metadata Simulation::metadata(const Condition& condition, std::uint64_t frame) const {
  const double seconds = static_cast<double>(frame) / camera().frame_rate;
  tofgraph_metadata m{};
  m.size = sizeof m;
  m.number = m.device_number = frame;
  m.timestamp_ns = physics::to_integer(seconds * 1e9, std::int64_t{0});
  m.integration_time = condition.integration_time;
  m.modulation_frequency = camera().modulation_frequency;
  m.temperature = condition.temperature;
  m.time_since_power_on =
      std::isnan(condition.time_since_power_on) ? io::unknown : condition.time_since_power_on + seconds;
  return m;
}

}  // namespace tofgraph::simulation
