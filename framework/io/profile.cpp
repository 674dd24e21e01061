// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/profile.hpp"

#include "config/paths.hpp"
#include "config/quantity.hpp"
#include "io/bad_pixels.hpp"
#include "io/profile_lens.hpp"
#include "io/unknown.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <tofgraph/physics/exposures.hpp>

namespace tofgraph::io {
namespace {

using config::Diagnostics;
using config::Entry;
using config::Reader;
using config::Value;

/// Optional number.
double optional_number(config::Reader& reader, std::string_view key, std::string_view unit, std::string_view example) {
  return reader.number(key, unit, example, unknown);
}

void read_sources(const config::Value& list, std::vector<tofgraph_light>& lights, std::vector<std::string>& names,
                  config::Diagnostics& diagnostics) {
  constexpr std::string_view example = "{name: left, position: [-50 mm, 0 mm, 0 mm], amplitude: 1}";
  names.reserve(list.items.size());
  for (const config::Value& item : list.items) {
    config::Reader reader(item, diagnostics, "the source");
    tofgraph_light light{};
    light.name = names.emplace_back(reader.word("name", fmt::format("source{}", names.size()))).c_str();
    light.amplitude = reader.number("amplitude", "", "1", 1.0);
    const std::vector<double> position = reader.numbers("position", "m", "[-50 mm, 0 mm, 0 mm]");
    if (position.size() == 3)
      std::ranges::copy(position, light.position);
    else if (item.is_map())
      diagnostics.error(item.at, "a source needs a position of three lengths", fmt::format("example: {}", example));
    if (!(light.amplitude > 0))
      diagnostics.error(item.at, "the amplitude of a source must be positive", fmt::format("example: {}", example));
    reader.finish();
    lights.push_back(light);
  }
}

/// Raw images of a frame.
std::vector<tofgraph_exposure> read_exposures(const config::Value& list, config::Diagnostics& diagnostics) {
  constexpr std::string_view example = "example: exposures: [{phase: 0 deg}, {phase: 120 deg}, {phase: 240 deg}]";
  const std::size_t before = diagnostics.errors();
  if (!list.is_list()) {
    diagnostics.error(list.at, fmt::format("'exposures' is {}, expected a list", list.described()),
                      std::string(example));
    return {};
  }
  std::vector<tofgraph_exposure> exposures;
  for (const config::Value& item : list.items) {
    config::Reader reader(item, diagnostics, "the exposure");
    tofgraph_exposure exposure{};
    const std::size_t errors = diagnostics.errors();
    exposure.phase = reader.number("phase", "rad", "90 deg", std::nullopt);
    if (diagnostics.errors() == errors && std::abs(exposure.phase) > physics::two_pi * (1 + 1e-9))
      diagnostics.error(place_of(item, "phase"),
                        fmt::format("'phase' is {} deg, expected -360 to 360 deg",
                                    physics::short_number(exposure.phase * 180 / std::numbers::pi)),
                        "example: phase: 120 deg");
    exposure.frequency = reader.number("frequency", "Hz", "20 MHz", 0.0);
    if (diagnostics.errors() != errors) continue;
    if (const config::Entry* given = item.is_map() ? item.find("frequency") : nullptr;
        given != nullptr && exposure.frequency <= 0)
      diagnostics.error(given->value.at,
                        fmt::format("'frequency' is {}, expected more than 0", given->value.described()),
                        "example: frequency: 20 MHz");
    reader.finish();
    exposures.push_back(exposure);
  }
  if (diagnostics.errors() != before) return {};
  if (const std::string problem = physics::exposures_problem(exposures); !problem.empty())
    diagnostics.error(list.at, fmt::format("'exposures': {}", problem), std::string(example));
  return exposures;
}

/// Sets an unstated frequency of the camera to that of its exposures, or checks that one of them has it.
void settle_frequency(const config::Value& document, const std::vector<tofgraph_exposure>& exposures,
                      tofgraph_camera& camera, config::Diagnostics& diagnostics) {
  if (exposures.empty() || exposures[0].frequency == 0) return;
  const double first = exposures[0].frequency;
  if (std::isnan(camera.modulation_frequency)) camera.modulation_frequency = first;
  const auto is_own = [&](const tofgraph_exposure& e) { return e.frequency == camera.modulation_frequency; };
  if (std::ranges::none_of(exposures, is_own))
    diagnostics.error(
        place_of(document, "modulation_frequency"),
        fmt::format("'modulation_frequency' is {} MHz, which none of the exposures has: {}",
                    physics::short_number(camera.modulation_frequency * 1e-6), physics::exposures_text(exposures)),
        "omit it, or write the frequency of one of them");
}

/// Path of the model of this camera. A profile stored in a recording does not know its original folder, so a relative
/// path in it is ignored.
std::string read_model_path(config::Reader& reader, const config::Value& document, config::Diagnostics& diagnostics) {
  std::string text = reader.word("model", "");
  if (text.empty()) return text;
  const config::Position at = place_of(document, "model");
  const std::filesystem::path file = std::filesystem::absolute(config::path_at(text, at));
  std::error_code error;
  const bool own_file = at.source && std::filesystem::is_regular_file(at.source->name, error);
  if (!own_file && std::filesystem::path(text).is_relative()) return {};
  if (own_file && !std::filesystem::is_regular_file(file, error))
    diagnostics.error(at, fmt::format("there is no model {}", file.string()), "the path is relative to the profile");
  return file.string();
}

/// Reads data-sheet values that stages do not use.
DataSheet read_data_sheet(config::Reader& reader, config::Diagnostics& diagnostics) {
  const auto pair = [&](std::string_view key, std::string_view unit, std::string_view example) {
    std::array<double, 2> values = {unknown, unknown};
    if (const config::Entry* entry = reader.take(key)) read_pair(*entry, unit, example, values.data(), diagnostics);
    return values;
  };
  DataSheet sheet;
  sheet.sensor = reader.word("sensor", "");
  sheet.interface = reader.word("interface", "");
  sheet.measuring_range = pair("measuring_range", "m", "[0.3 m, 7 m]");
  sheet.field_of_view = pair("field_of_view", "rad", "[40 deg, 30 deg]");
  return sheet;
}

std::uint32_t read_size(config::Reader& reader, std::string_view key, config::Diagnostics& diagnostics) {
  const std::size_t errors = diagnostics.errors();
  const double size = reader.number(key, "", "204", std::nullopt);
  if (size >= 1 && size <= 16384 && size == std::floor(size)) return static_cast<std::uint32_t>(size);
  const config::Entry* entry = reader.take(key);  // null if the document is not a map; reported
  if (diagnostics.errors() == errors && entry != nullptr) {
    diagnostics.error(entry->value.at,
                      fmt::format("'{}' is {}, expected a whole number of pixels from 1 to 16384", key, size));
  }
  return 1;
}

}  // namespace

std::vector<std::string> profile_names() {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(config::profile_folder(), error)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  std::ranges::sort(names);
  return names;
}

std::filesystem::path find_profile(const std::string& name, const std::filesystem::path& base) {
  if (name.find('/') != std::string::npos || name.ends_with(".yaml")) return (base / name).lexically_normal();
  std::filesystem::path file = config::profile_folder() / (name + ".yaml");
  std::error_code error;  // for names that no file can have
  return std::filesystem::exists(file, error) ? file : std::filesystem::path{};
}

namespace {

std::vector<std::string> words_of(config::Reader& reader, std::string_view key) {
  std::vector<std::string> list;
  if (const config::Entry* entry = reader.take(key)) {
    for (const config::Value& item : entry->value.items) list.push_back(item.text);
  }
  return list;
}

/// Text of a profile as stored in recordings. Paths are made absolute if it has a table of rays, because recordings do
/// not know the folder of the profile.
std::string text_for_recordings(const config::Value& document, bool has_table) {
  if (has_table) return config::yaml_text(config::with_absolute_paths(document));
  return document.at.source ? document.at.source->text : "";
}

}  // namespace

io::CameraPtr read_profile(const config::Value& document, config::Diagnostics& diagnostics) {
  const std::size_t before = diagnostics.errors();
  config::check_version(document, "profile", 1, diagnostics);
  config::Reader reader(document, diagnostics, "the profile");
  reader.take("profile");
  tofgraph_camera camera{};
  camera.size = sizeof camera;
  camera.light_size = sizeof(tofgraph_light);
  camera.exposure_size = sizeof(tofgraph_exposure);
  const std::string name = reader.word("name", "unnamed");
  camera.name = name.c_str();
  camera.width = read_size(reader, "width", diagnostics);
  camera.height = read_size(reader, "height", diagnostics);
  std::vector<float> rays;
  read_lens(reader, camera, document, rays, diagnostics);
  camera.rays = rays.empty() ? nullptr : rays.data();
  camera.modulation_frequency = optional_number(reader, "modulation_frequency", "Hz", "20 MHz");
  std::vector<tofgraph_exposure> exposures;
  if (const config::Entry* entry = reader.take("exposures")) exposures = read_exposures(entry->value, diagnostics);
  camera.exposures = exposures.data();
  camera.exposure_count = exposures.size();
  settle_frequency(document, exposures, camera, diagnostics);
  std::vector<tofgraph_light> lights;
  std::vector<std::string> light_names;
  if (const config::Entry* sources = reader.take("sources"))
    read_sources(sources->value, lights, light_names, diagnostics);
  camera.lights = lights.data();
  camera.light_count = lights.size();
  const std::vector<double> times = reader.numbers("integration_time", "s", "[0.5 ms, 50 ms]");
  camera.integration_time[0] = times.size() == 2 ? times[0] : unknown;
  camera.integration_time[1] = times.size() == 2 ? times[1] : unknown;
  camera.frame_rate = optional_number(reader, "frame_rate", "Hz", "80 Hz");
  camera.gain = optional_number(reader, "gain", "counts m^2/s", "7.0e6 counts m^2/s");
  camera.contrast = optional_number(reader, "contrast", "", "0.5");
  camera.read_noise = optional_number(reader, "read_noise", "counts", "3 counts");
  camera.shot_noise = optional_number(reader, "shot_noise", "counts", "0.012 counts");
  camera.full_well = optional_number(reader, "full_well", "counts", "30000 counts");
  std::vector<std::string> measured = words_of(reader, "measured"), assumed = words_of(reader, "assumed");
  DataSheet sheet = read_data_sheet(reader, diagnostics);
  reader.word("source", "");
  const std::string model = read_model_path(reader, document, diagnostics);
  camera.model = model.c_str();
  const config::Entry* map = reader.take("bad_pixels");
  reader.finish();
  if (diagnostics.errors() != before) return nullptr;
  const std::string text = text_for_recordings(document, !rays.empty());
  camera.profile = text.c_str();
  auto result = std::make_shared<io::Camera>(camera);
  result->measured = std::move(measured);
  result->assumed = std::move(assumed);
  result->data_sheet = std::move(sheet);
  if (map != nullptr) read_bad_pixels(map->value, *result, diagnostics);
  return diagnostics.errors() == before ? result : nullptr;
}

std::string profile_text(const tofgraph_camera& camera) {
  const auto quoted = [](std::string text) {
    for (std::size_t at = 0; (at = text.find('\'', at)) != std::string::npos; at += 2) text.insert(at, 1, '\'');
    return "'" + text + "'";
  };
  std::string text =
      fmt::format("profile: 1\nname: {}\nwidth: {}\nheight: {}\n", quoted(camera.name), camera.width, camera.height);
  const auto number = [&text](std::string_view key, double value, std::string_view unit) {
    if (!std::isnan(value)) text += fmt::format("{}: {}{}\n", key, value, unit);
  };
  const auto pair = [&text](std::string_view key, const double* values, std::string_view unit) {
    if (!std::isnan(values[0])) text += fmt::format("{}: [{}{}, {}{}]\n", key, values[0], unit, values[1], unit);
  };
  pair("pixel_pitch", camera.pitch, " m");
  const bool metric = camera.focal_length / camera.pitch[0] == camera.focal_px[0] &&
                      camera.focal_length / camera.pitch[1] == camera.focal_px[1];
  if (metric)
    number("focal_length", camera.focal_length, " m");
  else
    pair("focal_length", camera.focal_px, " px");
  pair("principal_point", camera.principal_point, "");
  if (camera.lens_model == TOFGRAPH_LENS_FISHEYE) text += "lens: fisheye\n";
  text += fmt::format("distortion: [{}]\n", fmt::join(distortion_of(camera), ", "));
  if (camera.skew != 0) number("skew", camera.skew, "");
  number("modulation_frequency", camera.modulation_frequency, " Hz");
  if (camera.exposure_count > 0) text += "exposures:\n";
  for (const tofgraph_exposure& exposure :
       Strided<const tofgraph_exposure>{camera.exposures, camera.exposure_size, camera.exposure_count}) {
    const std::string frequency =
        exposure.frequency > 0 ? fmt::format(", frequency: {} Hz", exposure.frequency) : std::string();
    text += fmt::format("  - {{phase: {} rad{}}}\n", exposure.phase, frequency);
  }
  if (camera.light_count > 0) text += "sources:\n";
  for (const tofgraph_light& light : lights_of(camera)) {
    text += fmt::format("  - {{name: {}, position: [{} m, {} m, {} m], amplitude: {}}}\n", quoted(light.name),
                        light.position[0], light.position[1], light.position[2], light.amplitude);
  }
  pair("integration_time", camera.integration_time, " s");
  number("frame_rate", camera.frame_rate, " Hz");
  number("gain", camera.gain, " counts m^2/s");
  number("contrast", camera.contrast, "");
  number("read_noise", camera.read_noise, " counts");
  number("shot_noise", camera.shot_noise, " counts");
  number("full_well", camera.full_well, " counts");
  return text;
}

io::CameraPtr load_profile(const std::filesystem::path& file, config::Diagnostics& diagnostics) {
  const config::Value document = config::load_document(file);
  auto camera = read_profile(document, diagnostics);
  if (camera) std::const_pointer_cast<io::Camera>(camera)->file = file;
  return camera;
}

io::CameraPtr load_profile(const std::filesystem::path& file) {
  config::Diagnostics diagnostics;
  auto camera = load_profile(file, diagnostics);
  if (!camera) throw config::ConfigurationError(diagnostics);
  return camera;
}

}  // namespace tofgraph::io
