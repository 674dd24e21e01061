// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/files/scene_file.hpp"

#include "io/profile.hpp"
#include "simulation/files/camera_needs.hpp"
#include "simulation/files/sequence.hpp"

#include <fmt/format.h>
#include <tofgraph/physics/unwrapping.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::simulation {
namespace {

using config::Diagnostics;
using config::Entry;
using config::Reader;
using config::Value;

constexpr std::int64_t endless_count = std::numeric_limits<std::int64_t>::max();

/// Reports all missing profile values at once. Without lens and light no scene can be computed.
void check_camera(const Entry& entry, SceneFile& scene, Diagnostics& diagnostics) {
  const tofgraph_camera& camera = scene.camera->view();
  std::vector<Need> missing = missing_for_light(camera);
  if (!(camera.frame_rate > 0)) missing.push_back({"frame_rate", "frame_rate: 80 Hz"});
  if (!missing.empty())
    diagnostics.error(entry.value.at,
                      fmt::format("the profile of the camera '{}' has no {}, which a simulation needs", camera.name,
                                  keys_of(missing)),
                      added_to_profile(*scene.camera, missing));
  if (scene.noise.from == SceneNoise::From::profile && !has_noise(camera))
    diagnostics.error(entry.value.at,
                      fmt::format("the profile of the camera '{}' has no read_noise and shot_noise", camera.name),
                      fmt::format("write noise: none in the scene, or add the camera's own read_noise and shot_noise "
                                  "to {}",
                                  place_of_profile(*scene.camera)));
  if (!(camera.focal_length > 0) || camera.light_count == 0) scene.camera.reset();
}

/// Checks that the frequencies have a common unambiguous range if distances are output.
void check_range(const Entry& output, const tofgraph_camera& camera, Diagnostics& diagnostics) {
  const physics::Exposures exposures = physics::exposures_of(camera);
  if (exposures[0].frequency == 0 || physics::common_frequency(physics::frequencies_of(exposures, 0)) > 0) return;
  diagnostics.error(output.value.at,
                    fmt::format("the camera '{}' has no distance: the modulation frequencies have no common range ({})",
                                camera.name, physics::exposures_text(exposures)),
                    "example: output: phases, which phase_decoder takes with max_range");
}

void read_output(const Entry& entry, SceneFile& scene, Diagnostics& diagnostics) {
  static const std::vector<std::string> known = {"phases", "taps", "distance"};
  const std::vector<Value> one = {entry.value};
  const std::vector<Value>& items = entry.value.is_list() ? entry.value.items : one;
  scene.output.clear();
  if (items.empty()) diagnostics.error(entry.value.at, "'output' is an empty list", "example: output: phases");
  for (const Value& item : items) {
    if (std::ranges::find(known, item.text) == known.end())
      diagnostics.error(item.at, fmt::format("'output' is {}, expected one of: phases taps distance", item.described()),
                        config::suggestion(item.text, known, "outputs"));
    else if (std::ranges::find(scene.output, item.text) != scene.output.end())
      diagnostics.error(item.at, fmt::format("'output' names '{}' twice", item.text));
    else
      scene.output.push_back(item.text);
  }
}

void read_noise(const Entry& entry, SceneNoise& noise, Diagnostics& diagnostics) {
  if (entry.value.is_map()) {
    Reader reader(entry.value, diagnostics, "'noise'");
    noise.from = SceneNoise::From::scene;
    noise.read_noise = reader.number_within("read_noise", "counts", "3 counts", std::nullopt, 0, 1e6);
    noise.shot_noise = reader.number_within("shot_noise", "counts", "0.012 counts", std::nullopt, 0, 1e6);
    return reader.finish();
  }
  if (entry.value.text == "none")
    noise.from = SceneNoise::From::none;
  else if (entry.value.text != "profile")
    diagnostics.error(entry.value.at,
                      fmt::format("'noise' is {}, expected profile, none or numbers", entry.value.described()),
                      "example: noise: none");
}

void read_model(Reader& reader, const Value& document, SceneFile& scene) {
  const Entry* entry = document.find("model");
  if (entry != nullptr && !entry->value.is_map()) reader.input_file("model", "{light: reference, effects: []}");
  if (entry != nullptr) scene.model = entry->value;
  reader.take("model");
}

/// Unique name: as written, or the type with a number.
std::string name_of(const Object& object, bool written, const std::vector<std::string>& taken,
                    Diagnostics& diagnostics) {
  const auto is_taken = [&](const std::string& name) { return std::ranges::find(taken, name) != taken.end(); };
  if (written) {
    if (is_taken(object.name))
      diagnostics.error(object.at, fmt::format("two objects are called '{}'", object.name));
    else if (object.name.empty() || object.name.find('.') != std::string::npos)
      diagnostics.error(object.at, fmt::format("'{}' cannot be a name: it must be a word without dots", object.name));
    return object.name;
  }
  std::string name = object.type;
  for (int number = 2; is_taken(name); ++number) name = fmt::format("{}{}", object.type, number);
  return name;
}

void read_objects(const Entry* entry, SceneFile& scene, Diagnostics& diagnostics) {
  if (entry == nullptr) return;
  if (!entry->value.is_list() || entry->value.items.empty()) {
    diagnostics.error(entry->value.at,
                      fmt::format("'objects' is {}, expected a list of at least one object",
                                  entry->value.is_list() ? "an empty list" : entry->value.described()),
                      "example: objects: [{type: board, distance: 500 mm}]");
    return;
  }
  for (const Value& item : entry->value.items) {
    const std::size_t before = diagnostics.errors();
    const Object object = read_object(item, diagnostics);
    if (object.name.empty() && diagnostics.errors() != before) continue;  // reading failed before the name
    scene.objects.push_back(name_of(object, item.find("name") != nullptr, scene.objects, diagnostics));
  }
}

}  // namespace

SceneFile read_scene(const Value& document, Diagnostics& diagnostics) {
  const std::size_t before = diagnostics.errors();
  SceneFile scene;
  scene.document = document;
  config::check_version(document, "scene", 1, diagnostics);
  Reader reader(document, diagnostics, "the scene");
  reader.take("scene");
  scene.name = reader.word("name", "");
  const Entry* camera = reader.need("camera", "camcube2");
  if (camera != nullptr) scene.camera = io::find_camera(camera->value, diagnostics);
  read_model(reader, document, scene);
  scene.frames = reader.whole_number("frames", "4", scene.frames, 1, endless_count);
  if (const Entry* output = reader.take("output")) read_output(*output, scene, diagnostics);
  if (const Entry* output = document.find("output");
      output != nullptr && scene.camera && std::ranges::find(scene.output, "distance") != scene.output.end())
    check_range(*output, scene.camera->view(), diagnostics);
  if (const Entry* noise = reader.take("noise")) read_noise(*noise, scene.noise, diagnostics);
  if (scene.camera) check_camera(*camera, scene, diagnostics);
  scene.seed = reader.whole_number("seed", "1", scene.seed, 0, endless_count);
  scene.subpixels = reader.whole_number("subpixels", "3", scene.subpixels, 1, 16);
  scene.settings.integration_time = 1e-3;
  io::read_settings(reader, document, scene.camera.get(), scene.settings, diagnostics);
  read_objects(reader.need("objects", "[{type: board, distance: 500 mm}]"), scene, diagnostics);
  if (const Entry* sequence = reader.take("sequence"))
    scene.sequence = read_sequence(sequence->value, scene, diagnostics);
  reader.finish();
  if (diagnostics.errors() == before) check_values(scene, diagnostics);
  if (diagnostics.errors() == before) check_geometry(scene, diagnostics);
  return scene;
}

SceneFile read_scene(const std::filesystem::path& file, Diagnostics& diagnostics) {
  return read_scene(config::load_document(file), diagnostics);
}

}  // namespace tofgraph::simulation
